/* The example on a Cortex-M: start, text and exit by semihosting. QEMU plays the debugger. */
#include "platform.h"

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

union vector {
  uint32_t *stack;
  void (*handler)(void);
};

__attribute__((section(".vectors"), used)) static const union vector vectors[16] = {
    {.stack = &stack_top}, {.handler = reset}, {.handler = fault}, {.handler = fault},
    {.handler = fault},    {.handler = fault}, {.handler = fault},
};
