// SPDX-License-Identifier: GPL-3.0-or-later
// Another robot of the same design, modelled without the plant's equations: forces and momenta in place of pressures
// and speeds, a truss as its spring, other published forms of every effect. SI units, pressures in psi above the
// surroundings, displacements from the contracted stable state. docs/truths.md names the sources.
#ifndef VIRTUAL_ROBOT_FOREIGN_H
#define VIRTUAL_ROBOT_FOREIGN_H

// A von Mises truss with torsional hinges and exponential end stops.
typedef struct ForeignSpring {
  double half_span_m, rise_m, bar_N_m;  // two bars, from -rise to +rise
  double hinge_Nm, hinge_rest_rad;
  double stop_in_N, stop_in_m, stop_out_N, stop_out_m;  // force at the truss's own stable points, e-folding length
  double zero_m;                                        // contracted state, from the truss's lower stable point
  double unstable_m, extended_m;
} ForeignSpring;

// [2]: body, small actuator. An effect whose parameters are 0 is absent.
typedef struct ForeignRobot {
  ForeignSpring spring[2];
  double damping_Ns_m[2], area_N_psi[2], alpha_n_per_s[2], alpha_s_per_s[2];
  double half_mass_kg[2];  // head, tail
  double stand_mass_kg, small_mass_kg, segment_mass_kg;
  double wall_offset_m, wall_N_m, wall_Ns_m, mu_s, mu_k, load_cell_N_m;
  double positive_psi, negative_psi;
  double friction_factor;
  // Spring: Bouc-Wen, Maxwell slip, Prony series, Prandtl-Ishlinskii play, dead zone.
  double bouc_N[2], bouc_m, bouc_beta, bouc_power;
  double slip_N[2], slip_m[4], slip_share[4];
  double prony_N_m[2], prony_s[5], prony_share[5];
  double play_m[3];
  double gap_m;
  double area_slope;
  int area_form;  // 0 quadratic, 1 pouch
  // Air: valve that opens gradually, line, throat, leak, reservoir, hunting regulator.
  double opening_s;
  int line_form;  // 0 none, 1 second order, 2 ladder of three cells
  double line_s, line_damping;
  double throat_per_s, throat_ratio;
  int throat_by_volume;
  double orifice_per_s, check_per_s, check_psi;
  double reservoir_share[2], recharge_s[2];  // positive, vacuum
  int hunt_form;                             // 0 none, 1 skewed triangle, 2 relay with a lag
  double hunt_psi, hunt_Hz, hunt_phase, hunt_skew;
  // Sensors: second order, orifice; turbulent drop.
  int sensor_form;  // 0 none, 1 second order, 2 orifice
  double sensor_s, sensor_damping;
  double drop_share, drop_power;
  // Friction.
  int stribeck_form;  // 0 none, 1 Lorentz, 2 Tustin
  double stribeck_m_s;
  double direction_static, direction_kinetic;
  int direction_wall_only;
  double slope_rad, slope_rad_m;
  double tether_N, tether_m;
  // Effects in no library.
  double thermal_share, thermal_s;
  double warm_share, warm_s, warm_W;
  double creep_m_s, creep_psi, creep_limit_m;
  double bore_m, bore_wave_m[2], bore_phase[2];
  double seam_rise, seam_spacing_m, seam_width_m, seam_phase_m;
} ForeignRobot;

typedef struct ForeignTrial {
  int experiment, chamber;  // LOCOMOTION and so on; 0 body, 1 head, 2 tail
  int start;                // source that all chambers in use are connected to at first: 0 vent, 1 positive, 2 vacuum
  double travel_m, rate_m_s;
  int there_and_back;
  double creep_m[2];  // creep of body and small actuators before the trial; on return, at its end
  double tolerance;   // 1 = usual
  int frictionless;   // for tests: no damper, no wall, no dry friction
  double steps;       // output: accepted and rejected steps
} ForeignTrial;

typedef struct ForeignEdge {
  double time_s;
  int chamber, source;
} ForeignEdge;

typedef struct ForeignSample {
  double head_m, tail_m, crosshead_m, force_N;
  double pressure_psi[3];  // as the sensors see it
  double small_m[2];
  double energy_J;  // kinetic and spring
  int sliding[2];
} ForeignSample;

// Lets the robot settle, then samples it at `times_s` (increasing, from 0). Returns 0, or 1 if it gets stuck.
int foreign_run(const ForeignRobot *robot, ForeignTrial *trial, const ForeignEdge *edges, int edge_count,
                const double *times_s, int count, ForeignSample *samples);
double foreign_spring(const ForeignSpring *spring, double x, double crept);
double foreign_throat(double conductance_per_s, double ratio, double source_psi, double sink_psi);

#endif
