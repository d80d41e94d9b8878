/* The example on a computer. */
#include "platform.h"

#include <stdio.h>

void platform_write(const char *text) { fputs(text, stdout); }
