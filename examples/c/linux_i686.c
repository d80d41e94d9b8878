/* The example on Linux with 32 bits, without a C library: calls into the kernel by hand. */
#include "platform.h"

int main(void);

static int kernel(int call, int first, const void *second, int third) {
  __asm__ volatile("int $0x80" : "+a"(call) : "b"(first), "c"(second), "d"(third) : "memory");
  return call;
}

void platform_write(const char *text) {
  int length = 0;
  while (text[length] != '\0')
    length++;
  kernel(4, 1, text, length); /* write */
}

/* The kernel leaves the stack as a call would not: here it is aligned for SSE. */
__attribute__((force_align_arg_pointer)) void _start(void) {
  kernel(1, main(), 0, 0); /* exit */
}
