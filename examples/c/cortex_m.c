/* The example on a Cortex-M: start, text and exit by semihosting. QEMU plays the debugger. */
#include "platform.h"

#include <stddef.h>
#include <stdint.h>

int main(void);

extern uint32_t stack_top, data_start, data_end, data_source, bss_start, bss_end;

static int semihosting(int operation, const void *argument) {
  register int r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void platform_write(const char *text) { semihosting(0x04, text); }

/* The little of a C library that the example uses; the memory functions come with the Rust library. */
char *strcpy(char *to, const char *from) {
  char *start = to;
  while ((*to++ = *from++) != '\0') {
  }
  return start;
}

char *strcat(char *to, const char *from) {
  char *start = to;
  while (*to != '\0')
    to++;
  strcpy(to, from);
  return start;
}

static void start(void) {
  uint32_t *source = &data_source;
  for (uint32_t *word = &data_start; word < &data_end; word++)
    *word = *source++;
  for (uint32_t *word = &bss_start; word < &bss_end; word++)
    *word = 0;
  const uint32_t application_exit[2] = {0x20026u, (uint32_t)main()};
  semihosting(0x20, application_exit);
  for (;;) {
  }
}

/* The FPU is on before any code that may use it. */
__attribute__((naked)) void reset(void) {
  __asm__ volatile("ldr r0, =0xe000ed88\n"
                   "ldr r1, [r0]\n"
                   "orr r1, r1, #0xf00000\n"
                   "str r1, [r0]\n"
                   "dsb\n"
                   "isb\n"
                   "b %0\n"
                   :
                   : "i"(start));
}

static void fault(void) {
  const uint32_t internal_error[2] = {0x20024u, 1u};
  semihosting(0x20, internal_error);
  for (;;) {
  }
}

__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    (void (*)(void))&stack_top, reset, fault, fault, fault, fault, fault};
