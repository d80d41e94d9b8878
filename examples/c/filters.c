/* Every filter of the C interface on a made signal. What is printed must be the same on the host, on a chip, and in Python:
 * `make firmware-c` compares it with examples/c/expected.py. */
#include "compfilt.h"
#include "platform.h"

#include <stddef.h>
#include <stdint.h>

enum { SAMPLES = 1000, STILL = 400 };

static const float DT = 1.0f / 100.0f;
static const float STANDARD_GRAVITY = 9.75f; /* short in binary: a product with a power of two is exact */

/* A line of text: a name and numbers. A chip need not have a C library, so nothing of one is used. */
static char line[64];
static int length;

static void put(const char *text) {
  while (*text != '\0')
    line[length++] = *text++;
  line[length] = '\0';
}

static void begin(const char *name) {
  length = 0;
  put(name);
}

static void add(uint32_t number) {
  char hex[10] = " ";
  for (int digit = 0; digit < 8; digit++)
    hex[1 + digit] = "0123456789abcdef"[number >> (28 - 4 * digit) & 15];
  hex[9] = '\0';
  put(hex);
}

static void end(void) {
  put("\n");
  platform_write(line);
}

/* The bits of a number. */
union word {
  float number;
  uint32_t bits;
};

/* FNV-1a over the bits of numbers and flags. */
static uint32_t hash;

static void hash_word(uint32_t word) {
  for (int byte = 0; byte < 4; byte++)
    hash = (hash ^ (word >> (8 * byte) & 255)) * 16777619u;
}

static void hash_numbers(const float *numbers, int count) {
  for (int i = 0; i < count; i++) {
    const union word word = {numbers[i]};
    hash_word(word.bits);
  }
}

/* The signal: a linear congruential generator, from -1 to 1 in steps that a float has. */
static uint32_t seed;

static float noise(void) {
  seed = seed * 1664525u + 1013904223u;
  return (float)((int32_t)(seed >> 8) - 8388608) / 8388608.0f;
}

static void restart(void) {
  seed = 1;
  hash = 2166136261u;
}

static float missing(void) {
  union word word;
  word.bits = 0x7fc00000u;
  return word.number;
}

/* Two signals, the first of them with holes. */
static void two(int sample, float *y, float *u) {
  *y = noise();
  *u = noise();
  if (sample % 97 == 50)
    *y = missing();
}

/* The filters of one order differ in their types only. */
#define LINEAR(ORDER)                                                                                                  \
  static void run_##ORDER(const char *name, const CompfiltFilter##ORDER *filter) {                                     \
    CompfiltState##ORDER state;                                                                                        \
    CompfiltStatus status = compfilt_start_##ORDER(&state);                                                            \
    restart();                                                                                                         \
    for (int sample = 0; sample < SAMPLES && status == COMPFILT_STATUS_OK; sample++) {                                 \
      float y, u;                                                                                                      \
      uint8_t flags;                                                                                                   \
      two(sample, &y, &u);                                                                                             \
      status = compfilt_update_##ORDER(filter, &state, y, u, &flags);                                                  \
      hash_numbers(state.levels, ORDER);                                                                               \
      hash_word(flags);                                                                                                \
    }                                                                                                                  \
    begin(name);                                                                                                       \
    add((uint32_t)status);                                                                                             \
    add(hash);                                                                                                         \
    end();                                                                                                             \
  }

LINEAR(1)
LINEAR(2)
LINEAR(3)

/* A measurement at a fifth of the rate of the input: predictions, and corrections for all the time since the last. */
#define TWO_RATES(ORDER)                                                                                               \
  static void run_two_rates_##ORDER(const char *name, const CompfiltFilter##ORDER *filter) {                           \
    CompfiltState##ORDER state;                                                                                        \
    CompfiltStatus status = compfilt_start_##ORDER##_at(&state, 0.5f);                                                 \
    restart();                                                                                                         \
    for (int sample = 0; sample < SAMPLES && status == COMPFILT_STATUS_OK; sample++) {                                 \
      float y, u;                                                                                                      \
      two(sample, &y, &u);                                                                                             \
      status = compfilt_predict_##ORDER(filter, &state, u, NULL);                                                      \
      if (sample % 5 == 4 && status == COMPFILT_STATUS_OK)                                                             \
        status = compfilt_correct_##ORDER(filter, &state, y, NULL);                                                    \
      hash_numbers(state.levels, 1);                                                                                   \
    }                                                                                                                  \
    begin(name);                                                                                                       \
    add((uint32_t)status);                                                                                             \
    add(hash);                                                                                                         \
    end();                                                                                                             \
  }

TWO_RATES(1)
TWO_RATES(2)
TWO_RATES(3)

static void run_rate(const CompfiltFilter1 *filter) {
  CompfiltRateState state;
  CompfiltStatus status = compfilt_rate_start(&state, 0.25f);
  restart();
  for (int sample = 0; sample < SAMPLES && status == COMPFILT_STATUS_OK; sample++) {
    const float gyro = noise();
    const float angular_acceleration = noise();
    status = compfilt_rate_update(filter, &state, gyro, angular_acceleration);
    hash_numbers(state.levels, 1);
  }
  begin("rate");
  add((uint32_t)status);
  add(hash);
  end();
}

/* A body that lies still at first, then moves; then one sample in a while is missing. */
static void three(int sample, float gyro[3], float acc[3], float mag[3]) {
  const float size = sample < STILL ? 1.0f / 1024.0f : 1.0f;
  for (int axis = 0; axis < 3; axis++) {
    gyro[axis] = noise() * size;
    acc[axis] = noise() * size;
    mag[axis] = noise() * 0.125f * size;
  }
  acc[2] += STANDARD_GRAVITY;
  mag[1] += 1.0f;
  if (sample % 97 == 50 && sample >= STILL)
    acc[0] = missing();
}

#define TILT(ORDER)                                                                                                    \
  static void run_tilt_##ORDER(const char *name, const CompfiltFilter##ORDER *filter, uint8_t axes) {                  \
    CompfiltTiltState##ORDER state;                                                                                    \
    CompfiltStatus status = compfilt_tilt_start_##ORDER(&state);                                                       \
    restart();                                                                                                         \
    for (int sample = 0; sample < SAMPLES && status == COMPFILT_STATUS_OK; sample++) {                                 \
      float gyro[3], acc[3], mag[3], angles[2];                                                                        \
      uint8_t flags;                                                                                                   \
      three(sample, gyro, acc, mag);                                                                                   \
      status = compfilt_tilt_update_##ORDER(filter, axes, &state, gyro, acc, &flags);                                  \
      if (status == COMPFILT_STATUS_OK)                                                                                \
        status = compfilt_tilt_angles_##ORDER(filter, axes, &state, angles);                                           \
      hash_numbers(angles, 2);                                                                                         \
      hash_word(flags);                                                                                                \
    }                                                                                                                  \
    begin(name);                                                                                                       \
    add((uint32_t)status);                                                                                             \
    add(hash);                                                                                                         \
    end();                                                                                                             \
  }

TILT(1)
TILT(2)

static void run_mahony(const CompfiltMahony *filter) {
  CompfiltMahonyState state;
  CompfiltStatus status = compfilt_mahony_start(&state);
  restart();
  for (int sample = 0; sample < SAMPLES && status == COMPFILT_STATUS_OK; sample++) {
    float gyro[3], acc[3], mag[3];
    uint8_t flags;
    three(sample, gyro, acc, mag);
    status = compfilt_mahony_update(filter, &state, gyro, acc, mag, &flags);
    hash_numbers(&state.rotation.w, 1);
    hash_numbers(state.rotation.v, 3);
    hash_numbers(state.bias, 3);
    hash_word(flags);
  }
  begin("mahony");
  add((uint32_t)status);
  add(hash);
  end();
}

static void run_gravity(const CompfiltGravity *filter) {
  CompfiltGravityState state;
  CompfiltStatus status = compfilt_gravity_start(&state);
  restart();
  for (int sample = 0; sample < SAMPLES && status == COMPFILT_STATUS_OK; sample++) {
    float gyro[3], acc[3], mag[3], quaternion[4];
    uint8_t flags;
    three(sample, gyro, acc, mag);
    status = compfilt_gravity_update(filter, &state, gyro, acc, mag, &flags);
    if (status == COMPFILT_STATUS_OK)
      status = compfilt_gravity_attitude(filter, &state, quaternion);
    hash_numbers(quaternion, 4);
    hash_numbers(state.rest.bias, 3);
    hash_word(flags);
    hash_word(state.resting);
  }
  begin("gravity");
  add((uint32_t)status);
  add(hash);
  end();
}

static void run_calibrating(const CompfiltCalibrating *filter) {
  CompfiltCalibratingState state;
  CompfiltStatus status = compfilt_calibrating_start(&state);
  restart();
  for (int sample = 0; sample < SAMPLES && status == COMPFILT_STATUS_OK; sample++) {
    float gyro[3], acc[3], mag[3], quaternion[4];
    uint8_t flags;
    three(sample, gyro, acc, mag);
    status = compfilt_calibrating_update(filter, &state, gyro, acc, NULL, &flags);
    if (status == COMPFILT_STATUS_OK)
      status = compfilt_calibrating_attitude(filter, &state, quaternion);
    hash_numbers(quaternion, 4);
    hash_numbers(state.rest.bias, 3);
    hash_word(flags);
  }
  begin("calibrating");
  add((uint32_t)status);
  add(hash);
  end();
}

/* What cannot work is refused. */
static void run_refused(void) {
  CompfiltFilter1 filter;
  CompfiltState1 state;
  CompfiltMahony mahony;
  begin("refused");
  add((uint32_t)compfilt_first_order(0.5f, DT, NULL));
  add((uint32_t)compfilt_first_order(-0.5f, DT, &filter));
  add((uint32_t)compfilt_first_order(0.5f, 0.0f, &filter));
  add((uint32_t)compfilt_mahony(1.0f, 0.1f, 3, DT, &mahony));
  compfilt_first_order(0.5f, DT, &filter);
  compfilt_start_1(&state);
  filter.input = 255;
  add((uint32_t)compfilt_update_1(&filter, &state, 0.0f, 0.0f, NULL));
  end();
}

/* The bytes of a struct. */
static void hash_bytes(const void *start, size_t size) {
  const unsigned char *bytes = start;
  hash = 2166136261u;
  for (size_t i = 0; i < size; i++)
    hash = (hash ^ bytes[i]) * 16777619u;
}

static uint32_t changed;

/* Whether a call is refused, and leaves what it would have changed as it was. */
#define UNTOUCHED(PLACE, CALL)                                                                                         \
  do {                                                                                                                 \
    hash_bytes(&(PLACE), sizeof(PLACE));                                                                               \
    const uint32_t before = hash;                                                                                      \
    const CompfiltStatus status = (CALL);                                                                              \
    hash_bytes(&(PLACE), sizeof(PLACE));                                                                               \
    changed += status == COMPFILT_STATUS_OK || hash != before;                                                         \
  } while (0)

static void run_untouched(CompfiltFilter1 filter, CompfiltFilter2 pi, CompfiltMahony mahony, CompfiltGravity gravity) {
  const float vector[3] = {0.0f, 0.0f, 1.0f};
  CompfiltState1 state;
  CompfiltTiltState2 tilt;
  CompfiltRateState rate;
  CompfiltMahonyState mahony_state;
  CompfiltGravityState gravity_state;
  CompfiltStatus status = compfilt_start_1_at(&state, 1.0f);
  status |= compfilt_tilt_start_2(&tilt);
  status |= compfilt_rate_start(&rate, 1.0f);
  status |= compfilt_mahony_start(&mahony_state);
  status |= compfilt_gravity_start(&gravity_state);
  changed = status != COMPFILT_STATUS_OK;
  UNTOUCHED(filter, compfilt_first_order(-0.5f, DT, &filter));
  UNTOUCHED(filter, compfilt_first_order(0.5f, 0.0f, &filter));
  UNTOUCHED(mahony, compfilt_mahony(1.0f, 0.1f, 3, DT, &mahony));
  UNTOUCHED(state, compfilt_start_1_at(&state, missing()));
  UNTOUCHED(state, compfilt_update_1(NULL, &state, 0.0f, 0.0f, NULL));
  UNTOUCHED(rate, compfilt_rate_update(&filter, &rate, missing(), 0.0f));
  UNTOUCHED(tilt, compfilt_tilt_update_2(&pi, 3, &tilt, vector, vector, NULL));
  UNTOUCHED(tilt, compfilt_tilt_update_2(&pi, 0, &tilt, vector, NULL, NULL));
  UNTOUCHED(mahony_state, compfilt_mahony_update(&mahony, &mahony_state, NULL, vector, NULL, NULL));
  UNTOUCHED(gravity_state, compfilt_gravity_update(&gravity, &gravity_state, vector, NULL, NULL, NULL));
  filter.input = 255;
  UNTOUCHED(state, compfilt_update_1(&filter, &state, 0.0f, 0.0f, NULL));
  UNTOUCHED(state, compfilt_predict_1(&filter, &state, 0.0f, NULL));
  UNTOUCHED(state, compfilt_correct_1(&filter, &state, 0.0f, NULL));
  mahony.form = 3;
  UNTOUCHED(mahony_state, compfilt_mahony_update(&mahony, &mahony_state, vector, vector, NULL, NULL));
  state.pending = 3;
  UNTOUCHED(state, compfilt_predict_1(&filter, &state, 0.0f, NULL));
  begin("untouched");
  add(changed);
  end();
}

int main(void) {
  CompfiltFilter1 first_order;
  CompfiltFilter2 pi, butterworth;
  CompfiltFilter3 third_order, of_gains;
  CompfiltMahony mahony;
  CompfiltGravityDesign design;
  CompfiltGravity gravity;
  CompfiltCalibrating calibrating;
  CompfiltStatus status = compfilt_first_order(0.5f, DT, &first_order);
  status |= compfilt_pi(2.0f, 1.0f, DT, &pi);
  status |= compfilt_butterworth(2.0f, 0.75f, DT, &butterworth);
  status |= compfilt_third_order(1.0f, DT, &third_order);
  status |= compfilt_third_order_from_gains(3.0f, 2.5f, 0.5f, DT, &of_gains);
  status |= compfilt_mahony(1.0f, 0.25f, COMPFILT_MAHONY_FORM_EXPLICIT, DT, &mahony);
  status |= compfilt_gravity_defaults(&design);
  status |= compfilt_gravity(&design, DT, &gravity);
  design.tau = 5.0f;
  status |= compfilt_calibrating(&design, DT, &calibrating);
  if (status != COMPFILT_STATUS_OK)
    return 1;
  run_1("first_order", &first_order);
  run_2("pi", &pi);
  run_2("butterworth", &butterworth);
  run_3("third_order", &third_order);
  run_3("third_order_from_gains", &of_gains);
  run_two_rates_1("two_rates_1", &first_order);
  run_two_rates_2("two_rates_2", &pi);
  run_two_rates_3("two_rates_3", &third_order);
  run_rate(&first_order);
  run_tilt_1("tilt_first_order", &first_order, COMPFILT_AXES_FLU);
  run_tilt_2("tilt_pi", &pi, COMPFILT_AXES_FLU);
  run_tilt_2("tilt_frd", &pi, COMPFILT_AXES_FRD);
  run_tilt_2("tilt_cube", &pi, COMPFILT_AXES_CUBE);
  run_mahony(&mahony);
  run_gravity(&gravity);
  run_calibrating(&calibrating);
  run_refused();
  run_untouched(first_order, pi, mahony, gravity);
  return 0;
}
