/* compfilt: complementary filters. Made from crates/compfilt-capi: do not change it by hand.
 *
 * Design -> filter -> state. A function that makes a filter takes what a person wants, in seconds and rad/s, and a sample period
 * in seconds; the filter is then constant. The state is what changes. Arithmetic is float (binary32), with the bits of the Rust
 * library and of Python's float32. Angles in rad, rates in rad/s, specific forces in m/s^2, body axes x forward, y left, z up.
 * Nothing allocates, blocks or fails after the design; a function may be called from an interrupt, but not on one state from two
 * places at once. Structs are plain: copy them, keep them, put filters into flash.
 *
 * Every function answers with a CompfiltStatus; where it is not COMPFILT_STATUS_OK, nothing was changed. */

#ifndef COMPFILT_H
#define COMPFILT_H

#include <stddef.h>
#include <stdint.h>

// What a function answers. Where it is not OK, nothing was changed.
enum CompfiltStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done.
  COMPFILT_STATUS_OK = 0,
  // A pointer is NULL that must not be.
  COMPFILT_STATUS_NULL = 1,
  // A parameter breaks its rule: most must be positive and finite.
  COMPFILT_STATUS_PARAMETER = 2,
  // The sample period is not positive and finite, or so small or large that a gain vanishes or overflows.
  COMPFILT_STATUS_SAMPLE_PERIOD = 3,
  // A struct was not made by a function of this library, or has been overwritten.
  COMPFILT_STATUS_STRUCT = 4,
  // A sample that must be there is NaN or infinite.
  COMPFILT_STATUS_SAMPLE = 5,
  // The filter has not started: no measurement has come yet.
  COMPFILT_STATUS_NOT_STARTED = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum CompfiltStatus CompfiltStatus;
#else
typedef int32_t CompfiltStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The body's axes, with the two angles that gravity gives in them.
enum CompfiltAxes
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Forward, left, up: roll about x, pitch about y, nose down positive.
  COMPFILT_AXES_FLU = 0,
  // Forward, right, down: roll about x, pitch about y, nose up positive.
  COMPFILT_AXES_FRD = 1,
  // The balancing cube's phi_2 and phi_3.
  COMPFILT_AXES_CUBE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum CompfiltAxes CompfiltAxes;
#else
typedef uint8_t CompfiltAxes;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What happened to a sample: the bits of a set of flags.
enum CompfiltFlag
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The measurement was missing, so the sample is predicted only.
  COMPFILT_FLAG_MEASUREMENT_MISSING = 1,
  // The derivative or the gyro was missing, and the last one was held.
  COMPFILT_FLAG_DERIVATIVE_HELD = 2,
  // It has been missing for longer than it is held, and counted as zero.
  COMPFILT_FLAG_DERIVATIVE_MISSING = 4,
  // No measurement has come yet.
  COMPFILT_FLAG_NOT_STARTED = 8,
  // The state had overflowed, or there was a gap, and the filter was started anew.
  COMPFILT_FLAG_RESTARTED = 16,
  // The magnetometer was missing, so the heading was predicted only.
  COMPFILT_FLAG_MAGNETOMETER_MISSING = 64,
  // The measured direction is opposite to the estimated one.
  COMPFILT_FLAG_AMBIGUOUS = 128,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum CompfiltFlag CompfiltFlag;
#else
typedef uint8_t CompfiltFlag;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How the measured directions become an innovation, and where the gyro turns the estimate.
enum CompfiltMahonyForm
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Straight from the directions.
  COMPFILT_MAHONY_FORM_EXPLICIT = 0,
  // From an attitude that is rebuilt from the directions.
  COMPFILT_MAHONY_FORM_PASSIVE = 1,
  // The same, and the gyro turns the estimate through the rebuilt attitude.
  COMPFILT_MAHONY_FORM_DIRECT = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum CompfiltMahonyForm CompfiltMahonyForm;
#else
typedef uint8_t CompfiltMahonyForm;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a person wants of a gravity filter: `compfilt_gravity_defaults` fills it, then change what you like.
typedef struct CompfiltGravityDesign {
  // The time constant in s: 3, or 5 for the self-calibrating filter.
  float tau;
  // The damping ratio: 0.5.
  float zeta;
  // How much later in s the accelerometer's samples are than the frame that the gyro turns: 0.
  float gyro_delay;
  // How far in s the attitude is turned ahead: 0.
  float advance;
  // How long in s a missing gyro is bridged by the last sample: 0.1.
  float hold;
  // The accelerometer's range in m/s^2: a component at it or beyond it is clipped, and counts as missing. 0: not known.
  float acc_range;
  // How long in s a body must be still to count as resting: 1.5.
  float rest_time;
  // How far in rad/s the gyro may be from its low-pass then: 2 deg/s.
  float rest_rate;
  // How far in m/s^2 the accelerometer may be from its low-pass then: 0.5.
  float rest_force;
  // How far in m/s^2 the low-passed accelerometer may drift in a rest: 0.1.
  float rest_drift;
  // The largest bias of an axis in rad/s: 2 deg/s.
  float bias_limit;
  // The time constant of the heading in s: 10.
  float heading_tau;
} CompfiltGravityDesign;

// When a body counts as resting.
typedef struct CompfiltRestRule {
  // The memory of the low-passes in s.
  float memory;
  // How long in s a body must be still.
  float time;
  // How far in rad/s the gyro may be from its low-pass.
  float rate;
  // How far in m/s^2 the accelerometer may be from its low-pass.
  float force;
  // How far in m/s^2 the low-passed accelerometer may drift in a rest.
  float drift;
  // The largest bias in rad/s on an axis.
  float bias_limit;
  // The memory of the bias in s.
  float bias_memory;
} CompfiltRestRule;

// How the heading follows the magnetometer.
typedef struct CompfiltHeadingRule {
  // The time constant in s.
  float tau;
} CompfiltHeadingRule;

// What a filter knows of its sensors.
typedef struct CompfiltSensors {
  // How far in s the specific force is moved ahead.
  float delay;
  // How far in s the attitude is turned ahead.
  float advance;
  // How long in s a missing gyro is bridged.
  float hold;
  // A time step in s after which the vertical is sought anew.
  float gap;
  // What an accelerometer's component stays below in m/s^2.
  float force_range;
} CompfiltSensors;

// A self-calibrating gravity filter at one sample period: constant while it runs, and may lie in flash.
typedef struct CompfiltCalibrating {
  // In rad/s.
  float omega0;
  // The damping ratio.
  float zeta;
  // When the body rests.
  struct CompfiltRestRule rest;
  // How the heading follows the magnetometer.
  struct CompfiltHeadingRule heading;
  // What is known of the sensors.
  struct CompfiltSensors sensors;
  // The length of a block in s.
  float block;
  // Prior standard deviations of the bias in rad/s, of the matrix, and of the delay in s.
  float prior[3];
  // What matrix and delay may be at most; the bias has the rest's limit.
  float limits[2];
  // How fast knowledge of the bias gets old, in rad/s per root s.
  float bias_walk;
  // The variance density that the velocity's innovations are taken to have.
  float noise;
  // Seconds after the start from which on parameters are learnt.
  float learn_after;
  // The sensitivity errors that are known before, column by column.
  float known[3][3];
  // The sample period in s.
  float dt;
} CompfiltCalibrating;

// A unit quaternion w + x i + y j + z k, from body to world: x east, y north, z up.
typedef struct CompfiltRotation {
  // The scalar part.
  float w;
  // The vector part.
  float v[3];
} CompfiltRotation;

// Whether the body rests, and the gyro's bias.
typedef struct CompfiltRest {
  // The gyro's bias in rad/s.
  float bias[3];
  // The low-passed gyro in rad/s.
  float gyro[3];
  // The low-passed accelerometer in m/s^2.
  float force[3];
  // Where that was when the body last was not still.
  float anchor[3];
  // How long in s the low-passes have been running, at most their memory.
  float age;
  // How long in s the body has been still, at most the time that makes a rest.
  float still;
  // How long in s it has rested in all, at most the bias's memory.
  float rested;
  // Whether the low-passes have begun.
  uint8_t begun;
} CompfiltRest;

// How the filter depends on one parameter.
typedef struct CompfiltSlope {
  // Of the low-passed force.
  float mean[3];
  // Of its velocity.
  float velocity[3];
  // The information gathered so far.
  float information;
} CompfiltSlope;

// What a block of samples adds up to.
typedef struct CompfiltBlock {
  // The force in the gyro's frame, times time.
  float force[3];
  // What it would be more by for each second that it is moved ahead, times time.
  float ahead[3];
  // How long there was a force.
  float force_time;
  // How the frame turns with each parameter.
  float turned[12][3];
  // Seconds.
  float time;
} CompfiltBlock;

// The last rate.
typedef struct CompfiltHeldRate {
  // In rad/s.
  float value[3];
  // Seconds since it came.
  float age;
} CompfiltHeldRate;

// What is known of the heading.
typedef struct CompfiltHeading {
  // Seconds since the first field.
  float age;
  // Seconds since the last.
  float since;
  // Whether a field has set the heading.
  uint8_t known;
} CompfiltHeading;

// The state of a self-calibrating gravity filter.
typedef struct CompfiltCalibratingState {
  // From body to the gyro's frame.
  struct CompfiltRotation frame;
  // The low-passed specific force in that frame, m/s^2.
  float mean[3];
  // Its velocity.
  float velocity[3];
  // The attitude.
  struct CompfiltRotation rotation;
  // What was learnt of the sensitivity errors, column by column, to be added to those known before.
  float matrix[3][3];
  // What was learnt of the delay in s.
  float delay;
  // Rest, and the gyro's bias.
  struct CompfiltRest rest;
  // How the filter depends on its parameters: the bias, the matrix row by row, the delay.
  struct CompfiltSlope slopes[13];
  // The block under way.
  struct CompfiltBlock block;
  // The last rate.
  struct CompfiltHeldRate rate;
  // The heading's filter.
  struct CompfiltHeading heading;
  // Seconds since the start.
  float age;
  // Whether there is an attitude.
  uint8_t started;
  // Whether the first block is over.
  uint8_t settled;
  // Whether the body rests.
  uint8_t resting;
} CompfiltCalibratingState;

// What a gravity filter has beside its gains.
typedef struct CompfiltGravitySettings {
  // k_1, k_2 in 1/s, 1/s^2.
  float coefficients[2];
  // How many of the polynomial's terms are in the low-pass.
  size_t split;
  // When the body rests.
  struct CompfiltRestRule rest;
  // How the heading follows the magnetometer.
  struct CompfiltHeadingRule heading;
  // What is known of the sensors.
  struct CompfiltSensors sensors;
  // The most seconds for which one sample of the accelerometer counts.
  float cap;
  // How long in s the start lasts.
  float start;
} CompfiltGravitySettings;

// The gains of a gravity filter.
typedef struct CompfiltGravityGains {
  // The sample period in s.
  float dt;
  // Half of it.
  float half_dt;
  // Of level 1 to the levels above it.
  float feedback[2];
  // What level 1 is multiplied by.
  float damping;
  // What the innovation is multiplied by.
  float correction[2];
} CompfiltGravityGains;

// A gravity filter at one sample period: constant while it runs, and may lie in flash.
typedef struct CompfiltGravity {
  // What it has beside its gains.
  struct CompfiltGravitySettings filter;
  // Its gains.
  struct CompfiltGravityGains gains;
} CompfiltGravity;

// The state of a gravity filter.
typedef struct CompfiltGravityState {
  // The low-passed specific force in m/s^2, body axes, and its slope.
  float levels[2][3];
  // The attitude.
  struct CompfiltRotation rotation;
  // Rest, and the gyro's bias.
  struct CompfiltRest rest;
  // The last rate.
  struct CompfiltHeldRate rate;
  // The heading's filter.
  struct CompfiltHeading heading;
  // Seconds since the start.
  float age;
  // Seconds since the last correction.
  float since_correction;
  // Whether there is an attitude.
  uint8_t started;
  // Whether the body rests.
  uint8_t resting;
} CompfiltGravityState;

// A filter of order 1 at one sample period: constant while it runs, and may lie in flash.
typedef struct CompfiltFilter1 {
  // k_1 in 1/s.
  float coefficients[1];
  // 0: u is the mean over the step that it ends; 1: u is instantaneous, on a straight line from the sample before.
  uint8_t input;
  // Wraps the innovation into half of it to both sides: 2 pi for an angle in rad. 0: not at all.
  float period;
  // For how many seconds a missing u keeps its last value; then it counts as 0.
  float hold;
  // The most seconds for which the one measurement after a gap counts.
  float gap_cap;
  // The sample period in s.
  float shifts[1];
  // What a ramp of u adds.
  float ramp[1];
  // What the innovation is multiplied by.
  float correction[1];
} CompfiltFilter1;

// A filter of order 2 with the first derivative as input: PI, Butterworth, or a chain. Fields as in CompfiltFilter1.
typedef struct CompfiltFilter2 {
  // k_1, k_2 in 1/s, 1/s^2.
  float coefficients[2];
  // 0: mean; 1: instantaneous.
  uint8_t input;
  // For the innovation; 0: none.
  float period;
  // In s.
  float hold;
  // In s.
  float gap_cap;
  // The sample period in s, and its power.
  float shifts[2];
  // What a ramp of u adds.
  float ramp[2];
  // What the innovation is multiplied by, for every level.
  float correction[2];
} CompfiltFilter2;

// A filter of order 3 with the second derivative as input: position from an acceleration. Fields as in CompfiltFilter1.
typedef struct CompfiltFilter3 {
  // k_1, k_2, k_3 in 1/s, 1/s^2, 1/s^3.
  float coefficients[3];
  // 0: mean; 1: instantaneous.
  uint8_t input;
  // For the innovation; 0: none.
  float period;
  // In s.
  float hold;
  // In s.
  float gap_cap;
  // The sample period in s, and its powers.
  float shifts[3];
  // What a ramp of u adds.
  float ramp[3];
  // What the innovation is multiplied by, for every level.
  float correction[3];
} CompfiltFilter3;

// The state of a filter of order 1. Read the levels; leave the rest to the library.
typedef struct CompfiltState1 {
  // The estimate; NaN before the start.
  float levels[1];
  // The levels after the last correction.
  float start[1];
  // What u has added since.
  float driven[1];
  // Seconds since the last correction.
  float elapsed;
  // The last u.
  float input;
  // Its age in s.
  float input_age;
  // Whether the levels are known.
  uint8_t started;
  // What has happened since the last correction: 0 nothing, 1 one step, 2 one long step.
  uint8_t pending;
} CompfiltState1;

// The state of a filter of order 2: level 1 is minus the error of u. Fields as in CompfiltState1.
typedef struct CompfiltState2 {
  // The estimate, and minus the error of u.
  float levels[2];
  // The levels after the last correction.
  float start[2];
  // What u has added since.
  float driven[2];
  // Seconds since the last correction.
  float elapsed;
  // The last u.
  float input;
  // Its age in s.
  float input_age;
  // Whether the levels are known.
  uint8_t started;
  // As in CompfiltState1.
  uint8_t pending;
} CompfiltState2;

// The state of a filter of order 3: position, velocity, minus the error of u. Fields as in CompfiltState1.
typedef struct CompfiltState3 {
  // Position, velocity, minus the error of u.
  float levels[3];
  // The levels after the last correction.
  float start[3];
  // What u has added since.
  float driven[3];
  // Seconds since the last correction.
  float elapsed;
  // The last u.
  float input;
  // Its age in s.
  float input_age;
  // Whether the levels are known.
  uint8_t started;
  // As in CompfiltState1.
  uint8_t pending;
} CompfiltState3;

// Mahony's filter at one sample period: constant while it runs, and may lie in flash.
typedef struct CompfiltMahony {
  // kp in 1/s, ki in 1/s^2.
  float coefficients[2];
  // A CompfiltMahonyForm.
  uint8_t form;
  // The length in rad/s that the bias may have at most.
  float bias_limit;
  // What is known of the sensors.
  struct CompfiltSensors sensors;
  // The sample period in s, and its power.
  float shifts[2];
  // What a ramp of the input adds.
  float ramp[2];
  // What the innovation is multiplied by: for the attitude, for the bias.
  float correction[2];
} CompfiltMahony;

// The state of Mahony's filter.
typedef struct CompfiltMahonyState {
  // The attitude.
  struct CompfiltRotation rotation;
  // The gyro's bias in rad/s.
  float bias[3];
  // The last rate.
  struct CompfiltHeldRate rate;
  // Seconds since the start.
  float age;
  // Seconds since the last correction of the tilt.
  float since_correction;
  // Seconds since the last correction of the heading.
  float since_heading;
  // Whether there is an attitude.
  uint8_t started;
  // Whether a magnetometer has set the heading.
  uint8_t heading_known;
} CompfiltMahonyState;

// The state of a rate filter, whose gains are those of a first-order filter with the same time constant.
typedef struct CompfiltRateState {
  // The estimated rate in rad/s.
  float levels[1];
  // The last gyro sample in rad/s.
  float gyro;
  // The integrated angular acceleration in rad/s.
  float integral;
  // Not used: a place of the core's.
  float value;
  // Not used: a place of the core's.
  float age;
} CompfiltRateState;

// The state of a tilt filter of order 1: a linear filter's for each angle.
typedef struct CompfiltTiltState1 {
  // Roll and pitch, or phi_2 and phi_3.
  struct CompfiltState1 angles[2];
} CompfiltTiltState1;

// The state of a tilt filter of order 2: a linear filter's for each angle. Level 1 is minus the bias of the angle's rate.
typedef struct CompfiltTiltState2 {
  // Roll and pitch, or phi_2 and phi_3.
  struct CompfiltState2 angles[2];
} CompfiltTiltState2;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The self-calibrating gravity filter of a design, at the sample period `dt` in s.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the filter, nobody changes the design.
CompfiltStatus compfilt_calibrating(const struct CompfiltGravityDesign *design,
                                    float dt,
                                    struct CompfiltCalibrating *filter);

// Starts a self-calibrating gravity filter: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_calibrating_start(struct CompfiltCalibratingState *state);

// One sample: as for `compfilt_gravity_update`.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
CompfiltStatus compfilt_calibrating_update(const struct CompfiltCalibrating *filter,
                                           struct CompfiltCalibratingState *state,
                                           const float *gyro,
                                           const float *acc,
                                           const float *mag,
                                           uint8_t *flags);

// The attitude turned ahead by the design's `advance`: the quaternion w, x, y, z from body to world.
//
// # Safety
// The pointers are NULL, or point to what they say; `quaternion` to four numbers that nobody else uses.
CompfiltStatus compfilt_calibrating_attitude(const struct CompfiltCalibrating *filter,
                                             const struct CompfiltCalibratingState *state,
                                             float *quaternion);

// Fills a design with the defaults of the gravity filter. For `compfilt_calibrating` set `tau` to 5.
//
// # Safety
// `design` is NULL, or points to a design that nobody else uses.
CompfiltStatus compfilt_gravity_defaults(struct CompfiltGravityDesign *design);

// The gravity filter of a design, at the sample period `dt` in s.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the filter, nobody changes the design.
CompfiltStatus compfilt_gravity(const struct CompfiltGravityDesign *design,
                                float dt,
                                struct CompfiltGravity *filter);

// Starts a gravity filter: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_gravity_start(struct CompfiltGravityState *state);

// One sample: `gyro` in rad/s, `acc` in m/s^2, `mag` of any length, three numbers each, body axes. What is NaN or infinite is
// missing. `mag` is NULL where there is no magnetometer; `flags` may be NULL.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
CompfiltStatus compfilt_gravity_update(const struct CompfiltGravity *filter,
                                       struct CompfiltGravityState *state,
                                       const float *gyro,
                                       const float *acc,
                                       const float *mag,
                                       uint8_t *flags);

// The attitude turned ahead by the design's `advance`: the quaternion w, x, y, z from body to world.
//
// # Safety
// The pointers are NULL, or point to what they say; `quaternion` to four numbers that nobody else uses.
CompfiltStatus compfilt_gravity_attitude(const struct CompfiltGravity *filter,
                                         const struct CompfiltGravityState *state,
                                         float *quaternion);

// First order with the time constant `tau` in s, at the sample period `dt` in s.
//
// # Safety
// `filter` is NULL, or points to a filter that nobody else uses.
CompfiltStatus compfilt_first_order(float tau, float dt, struct CompfiltFilter1 *filter);

// PI form with the gains `kp` in 1/s and `ki` in 1/s^2, at the sample period `dt` in s.
//
// # Safety
// `filter` is NULL, or points to a filter that nobody else uses.
CompfiltStatus compfilt_pi(float kp, float ki, float dt, struct CompfiltFilter2 *filter);

// Butterworth of order 2 at `omega0` in rad/s with the quality factor `q` (1 is Butterworth), at the sample period `dt` in s.
//
// # Safety
// `filter` is NULL, or points to a filter that nobody else uses.
CompfiltStatus compfilt_butterworth(float omega0,
                                    float q,
                                    float dt,
                                    struct CompfiltFilter2 *filter);

// Third order with a triple pole at -1/`tau`, `tau` in s, at the sample period `dt` in s.
//
// # Safety
// `filter` is NULL, or points to a filter that nobody else uses.
CompfiltStatus compfilt_third_order(float tau, float dt, struct CompfiltFilter3 *filter);

// Third order with the gains themselves, in 1/s, 1/s^2, 1/s^3, at the sample period `dt` in s.
//
// # Safety
// `filter` is NULL, or points to a filter that nobody else uses.
CompfiltStatus compfilt_third_order_from_gains(float k1,
                                               float k2,
                                               float k3,
                                               float dt,
                                               struct CompfiltFilter3 *filter);

// Starts a filter of order 1: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_start_1(struct CompfiltState1 *state);

// Starts a filter of order 1 from a known level 0; the others are zero. A NaN or infinite level is refused.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_start_1_at(struct CompfiltState1 *state, float level0);

// One sample of a filter of order 1: predicts with `u`, corrects by `y`. What is NaN or infinite is missing. `flags` may be
// NULL.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the filter.
CompfiltStatus compfilt_update_1(const struct CompfiltFilter1 *filter,
                                 struct CompfiltState1 *state,
                                 float y,
                                 float u,
                                 uint8_t *flags);

// Predicts a filter of order 1 by its sample period with `u`, where `y` comes more rarely. `flags` may be NULL.
//
// # Safety
// As for `compfilt_update_1`.
CompfiltStatus compfilt_predict_1(const struct CompfiltFilter1 *filter,
                                  struct CompfiltState1 *state,
                                  float u,
                                  uint8_t *flags);

// Corrects a filter of order 1 by `y`, for all the time since the last correction. `flags` may be NULL.
//
// # Safety
// As for `compfilt_update_1`.
CompfiltStatus compfilt_correct_1(const struct CompfiltFilter1 *filter,
                                  struct CompfiltState1 *state,
                                  float y,
                                  uint8_t *flags);

// Starts a filter of order 2: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_start_2(struct CompfiltState2 *state);

// Starts a filter of order 2 from a known level 0; the others are zero. A NaN or infinite level is refused.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_start_2_at(struct CompfiltState2 *state, float level0);

// One sample of a filter of order 2: predicts with `u`, corrects by `y`. What is NaN or infinite is missing. `flags` may be
// NULL.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the filter.
CompfiltStatus compfilt_update_2(const struct CompfiltFilter2 *filter,
                                 struct CompfiltState2 *state,
                                 float y,
                                 float u,
                                 uint8_t *flags);

// Predicts a filter of order 2 by its sample period with `u`, where `y` comes more rarely. `flags` may be NULL.
//
// # Safety
// As for `compfilt_update_2`.
CompfiltStatus compfilt_predict_2(const struct CompfiltFilter2 *filter,
                                  struct CompfiltState2 *state,
                                  float u,
                                  uint8_t *flags);

// Corrects a filter of order 2 by `y`, for all the time since the last correction. `flags` may be NULL.
//
// # Safety
// As for `compfilt_update_2`.
CompfiltStatus compfilt_correct_2(const struct CompfiltFilter2 *filter,
                                  struct CompfiltState2 *state,
                                  float y,
                                  uint8_t *flags);

// Starts a filter of order 3: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_start_3(struct CompfiltState3 *state);

// Starts a filter of order 3 from a known level 0; the others are zero. A NaN or infinite level is refused.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_start_3_at(struct CompfiltState3 *state, float level0);

// One sample of a filter of order 3: predicts with `u`, corrects by `y`. What is NaN or infinite is missing. `flags` may be
// NULL.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the filter.
CompfiltStatus compfilt_update_3(const struct CompfiltFilter3 *filter,
                                 struct CompfiltState3 *state,
                                 float y,
                                 float u,
                                 uint8_t *flags);

// Predicts a filter of order 3 by its sample period with `u`, where `y` comes more rarely. `flags` may be NULL.
//
// # Safety
// As for `compfilt_update_3`.
CompfiltStatus compfilt_predict_3(const struct CompfiltFilter3 *filter,
                                  struct CompfiltState3 *state,
                                  float u,
                                  uint8_t *flags);

// Corrects a filter of order 3 by `y`, for all the time since the last correction. `flags` may be NULL.
//
// # Safety
// As for `compfilt_update_3`.
CompfiltStatus compfilt_correct_3(const struct CompfiltFilter3 *filter,
                                  struct CompfiltState3 *state,
                                  float y,
                                  uint8_t *flags);

// Mahony's filter with the gains `kp` in 1/s and `ki` in 1/s^2, both positive, in one of the CompfiltMahonyForms, at the sample
// period `dt` in s.
//
// # Safety
// `filter` is NULL, or points to a filter that nobody else uses.
CompfiltStatus compfilt_mahony(float kp,
                               float ki,
                               uint8_t form,
                               float dt,
                               struct CompfiltMahony *filter);

// Starts Mahony's filter: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_mahony_start(struct CompfiltMahonyState *state);

// One sample: `gyro` in rad/s, `acc` and `mag` of any length, three numbers each, body axes. What is NaN or infinite is missing.
// `mag` is NULL where there is no magnetometer; `flags` may be NULL. The attitude is `state->rotation`.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
CompfiltStatus compfilt_mahony_update(const struct CompfiltMahony *filter,
                                      struct CompfiltMahonyState *state,
                                      const float *gyro,
                                      const float *acc,
                                      const float *mag,
                                      uint8_t *flags);

// Starts a rate filter at `rate` in rad/s, which the gyro is taken to have read. A NaN or infinite rate is refused.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_rate_start(struct CompfiltRateState *state,
                                   float rate);

// One sample: `gyro` in rad/s, `angular_acceleration` in rad/s^2. Where one of them is NaN or infinite, the answer says so and
// the state stays as it is. Where the filter itself overflows it starts anew at the gyro's rate. `filter` is made by `compfilt_first_order`.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state, nobody changes the filter.
CompfiltStatus compfilt_rate_update(const struct CompfiltFilter1 *filter,
                                    struct CompfiltRateState *state,
                                    float gyro,
                                    float angular_acceleration);

// Starts a tilt filter of order 1: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_tilt_start_1(struct CompfiltTiltState1 *state);

// One sample of a tilt filter of order 1: `gyro` in rad/s, `acc` of any length, three numbers each, body axes. What is NaN or
// infinite is missing. `filter` is made as for `compfilt_update_1`, with the angle's period or without; `axes` is one of the
// CompfiltAxes; `flags` may be NULL.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
CompfiltStatus compfilt_tilt_update_1(const struct CompfiltFilter1 *filter,
                                      uint8_t axes,
                                      struct CompfiltTiltState1 *state,
                                      const float *gyro,
                                      const float *acc,
                                      uint8_t *flags);

// The two angles in rad in their usual ranges: roll within pi and pitch within pi/2 to both sides, or phi_2 within pi/2 and phi_3
// within pi.
//
// # Safety
// The pointers are NULL, or point to what they say; `angles` to two numbers that nobody else uses.
CompfiltStatus compfilt_tilt_angles_1(const struct CompfiltFilter1 *filter,
                                      uint8_t axes,
                                      const struct CompfiltTiltState1 *state,
                                      float *angles);

// Starts a tilt filter of order 2: it waits for the first measurement.
//
// # Safety
// `state` is NULL, or points to a state that nobody else uses.
CompfiltStatus compfilt_tilt_start_2(struct CompfiltTiltState2 *state);

// One sample of a tilt filter of order 2: `gyro` in rad/s, `acc` of any length, three numbers each, body axes. What is NaN or
// infinite is missing. `filter` is made as for `compfilt_update_2`, with the angle's period or without; `axes` is one of the
// CompfiltAxes; `flags` may be NULL.
//
// # Safety
// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
CompfiltStatus compfilt_tilt_update_2(const struct CompfiltFilter2 *filter,
                                      uint8_t axes,
                                      struct CompfiltTiltState2 *state,
                                      const float *gyro,
                                      const float *acc,
                                      uint8_t *flags);

// The two angles in rad in their usual ranges: roll within pi and pitch within pi/2 to both sides, or phi_2 within pi/2 and phi_3
// within pi.
//
// # Safety
// The pointers are NULL, or point to what they say; `angles` to two numbers that nobody else uses.
CompfiltStatus compfilt_tilt_angles_2(const struct CompfiltFilter2 *filter,
                                      uint8_t axes,
                                      const struct CompfiltTiltState2 *state,
                                      float *angles);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* COMPFILT_H */
