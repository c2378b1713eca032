// SPDX-License-Identifier: GPL-3.0-or-later
// The robot, its air supply and its test stands. SI units, pressures in psi above the surroundings. Time is in seconds
// since plant_mount() and passes only in plant_advance() and plant_record().
#ifndef VIRTUAL_ROBOT_PLANT_H
#define VIRTUAL_ROBOT_PLANT_H

#include <stdint.h>

enum { BODY = 0, HEAD, TAIL, CHAMBERS };
enum { VENT = 0, POSITIVE, VACUUM };                                  // what a chamber is connected to
enum { LOCOMOTION = 0, STEP_RESPONSE, STATIC_LOADING, ANCHOR_PULL };  // experiment on the stand

// An effect is off at 0. Fields are named like the labels: <effect>_<parameter>.
typedef struct PlantParameters {
  // The paper's model, eqs. (1)-(8).
  double head_mass_kg, tail_mass_kg;
  double head_segment_mass_kg;  // in the anchor pull: a head alone, without its half of the body
  double body_damping_Ns_m, body_area_N_psi, body_alpha_n_per_s, body_alpha_s_per_s;
  double small_mass_kg, small_damping_Ns_m, small_area_N_psi, small_alpha_n_per_s, small_alpha_s_per_s;
  double wall_offset_m, wall_stiffness_N_m, wall_damping_Ns_m;
  double mu_s, mu_k;
  double supply_positive_psi, supply_negative_psi;
  double load_cell_N_m;
  // Set for each trial.
  double friction_factor;  // run-to-run variation of both coefficients
  double inclination_deg;  // the pipe's, as set up
  double ripple_phase_rad;
  double session_share;  // 0 = first trial of the day, 1 = last
  // Effects named in the contract.
  double hysteresis_force_N, hysteresis_displacement_m, hysteresis_small_share;
  double viscoelasticity_stiffness_N_m, viscoelasticity_time_s, viscoelasticity_small_share;
  double backlash_gap_m;
  double area_variation_slope;
  double valve_latency_delay_s;
  double valve_asymmetry_difference_s;
  double line_lag_time_s;
  double choked_flow_saturation_s_per_psi, choked_flow_sharpness;
  double leak_rate_per_s;
  double supply_sag_resistance_s, supply_sag_vacuum_share;
  double regulator_ripple_amplitude_psi, regulator_ripple_frequency_Hz;
  double sensor_lag_time_s;
  double sensor_position_share;
  double sensor_calibration_gain, sensor_calibration_offset_psi;
  double stribeck_speed_m_s;
  double friction_direction_asymmetry;
  double inclination_angle_deg;
  double tether_drag_drag_N_m;
  // Effects in no library.
  double pipe_joint_rise, pipe_joint_spacing_m, pipe_joint_width_m;
  double area_drift_share;
  double mount_resonance_share, mount_resonance_frequency_Hz, mount_resonance_damping;
  double viscous_drag_Ns_m;
  double leak_cracking_rate_per_s, leak_cracking_pressure_psi;
  double camera_scale_gain;
  double pump_fade_psi;
  double quadratic_damping_Ns2_m2;
  double sensor_crosstalk_share;
  // Added by the worn profile.
  double iso6358_share, iso6358_critical_ratio;  // 0 = linear filling, 1 = compressible flow throughout
  double regulator_time_s;
  double valve_opening_s, valve_closing_s;
} PlantParameters;

typedef struct PlantSample {  // true values, and readings before noise and conversion
  double time_s;
  double head_m, tail_m;          // as a noise-free camera sees them, 0 at the start of the trial
  double crosshead_m;             // position of the testing machine or the puller
  double force_N;                 // force of its load cell
  double pressure_psi[CHAMBERS];  // as the sensors see them
  double small_m[CHAMBERS];       // head and tail actuators
  int32_t connected[CHAMBERS];    // what each chamber's valves connect it to
  int32_t sliding_head, sliding_tail;
} PlantSample;

typedef struct Plant Plant;

// The springs are tables: `count` forces at equidistant displacements from `first_m` in steps of `step_m`.
Plant *plant_new(const PlantParameters *parameters, const double *body_force_N, int body_count, double body_first_m,
                 double body_step_m, const double *small_force_N, int small_count, double small_first_m,
                 double small_step_m);
void plant_free(Plant *plant);
double plant_spring(const Plant *plant, int small, double displacement_m);
void plant_landmarks(const Plant *plant, int small, double *contracted_m, double *unstable_m, double *extended_m);

// Puts an experiment on the stand and lets it settle with `start` connected; sets the time to 0.
// `chamber` is the actuator under test (BODY or HEAD) in a step response or static loading.
void plant_mount(Plant *plant, int experiment, int chamber, int start);
void plant_set_trial(Plant *plant, double friction_factor, double inclination_deg, double ripple_phase_rad,
                     double session_share);        // before plant_mount()
void plant_set_step(Plant *plant, double step_s);  // longest step of the integrator
void plant_set_supply(Plant *plant, double positive_psi);
void plant_connect(Plant *plant, double time_s, int chamber, int state);  // a command; call in order of time
void plant_move(Plant *plant, double start_s, double travel_m, double rate_m_s, int there_and_back);
int plant_moving(const Plant *plant);
void plant_advance(Plant *plant, double time_s);
void plant_sample(const Plant *plant, PlantSample *sample);
// Samples at start_s + i * period_s for i < count.
void plant_record(Plant *plant, double start_s, double period_s, int count, PlantSample *samples);
double plant_energy(const Plant *plant);  // kinetic + spring, J

// --- wired to the Uno: the addresses of the callbacks go into UnoWorld ---
// `clock_hz`: true frequency of the board's 16 MHz clock. `noise_memory_s`: correlation time of the sensors' noise (0 =
// white).
void plant_wire(Plant *plant, uint64_t start_cycle, double clock_hz, uint64_t noise_seed, double noise_psi,
                double noise_memory_s);
// Puts another experiment on the stand while the Uno keeps running: time is 0 at `cycle`, the valves keep their state.
void plant_remount(Plant *plant, int experiment, int chamber, uint64_t cycle);
void plant_break_sensor(Plant *plant, int channel, double volts);  // NaN = repaired
int plant_both_valves(const Plant *plant);  // how often both valves of a chamber were energised at once
void *plant_pin_changed_address(void);
void *plant_analog_volts_address(void);
void *plant_dac_changed_address(void);
// Times of the rising edges of the sampling strobe since the last call, in the plant's seconds.
int plant_strobes(Plant *plant, double *times_s, int capacity);
void plant_watch(Plant *plant, double period_s, double offset_s);  // an instrument samples at offset + n * period
int plant_watched(Plant *plant, PlantSample *samples, int capacity);

#endif
