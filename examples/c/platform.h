/* What the example needs of the place where it runs. */
#ifndef PLATFORM_H
#define PLATFORM_H

void platform_write(const char *text);

#endif
