// SPDX-License-Identifier: GPL-3.0-or-later
// Drives every entry point of plant.h, foreign.h and uno.h once or more, for AddressSanitizer and UBSan to watch.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "foreign.h"
#include "plant.h"
#include "uno.h"

enum { BODY_POINTS = 131, SMALL_POINTS = 91, ROWS = 800 };

// A sine between two stiff ends.
static void bistable(double *force, int count, double first, double step, double stroke, double peak) {
  for (int i = 0; i < count; i++) {
    double x = first + i * step, beyond = x < 0 ? x : x > stroke ? x - stroke : 0;
    force[i] = beyond != 0 ? 20000 * beyond : peak * sin(2 * M_PI * x / stroke);
  }
}

static Plant *make_plant(void) {
  PlantParameters p = {
      .head_mass_kg = 0.175,
      .tail_mass_kg = 0.175,
      .head_segment_mass_kg = 0.1,
      .body_damping_Ns_m = 130,
      .body_area_N_psi = 9,
      .body_alpha_n_per_s = 2,
      .body_alpha_s_per_s = 0.6,
      .small_mass_kg = 0.015,
      .small_damping_Ns_m = 15,
      .small_area_N_psi = 3.2,
      .small_alpha_n_per_s = 2.3,
      .small_alpha_s_per_s = 0.8,
      .wall_offset_m = 0.0277,
      .wall_stiffness_N_m = 8000,
      .wall_damping_Ns_m = 20,
      .mu_s = 0.45,
      .mu_k = 0.38,
      .supply_positive_psi = 8.5,
      .supply_negative_psi = -13,
      .load_cell_N_m = 5000,
      .friction_factor = 1,
      .backlash_gap_m = 0.001,
      .hysteresis_force_N = 2,
      .hysteresis_displacement_m = 0.002,
      .hysteresis_small_share = 0.2,
      .valve_latency_delay_s = 0.03,
      .iso6358_share = 0.5,
      .iso6358_critical_ratio = 0.35,
      .regulator_time_s = 0.1,
      .sensor_lag_time_s = 0.01,
      .line_lag_time_s = 0.05,
      .supply_sag_resistance_s = 0.02,
      .supply_sag_vacuum_share = 1,
      .mount_resonance_share = 1,
      .mount_resonance_frequency_Hz = 8,
      .mount_resonance_damping = 0.05,
  };
  double body[BODY_POINTS], small[SMALL_POINTS];
  bistable(body, BODY_POINTS, -0.00618, 0.000506, 0.0535, 32);
  bistable(small, SMALL_POINTS, -0.0041, 0.000422, 0.0298, 8);
  return plant_new(&p, body, BODY_POINTS, -0.00618, 0.000506, small, SMALL_POINTS, -0.0041, 0.000422);
}

static int try_stands(Plant *plant, PlantSample *rows) {
  for (int experiment = LOCOMOTION; experiment <= ANCHOR_PULL; experiment++) {
    int chamber = experiment == ANCHOR_PULL ? HEAD : BODY;
    plant_mount(plant, experiment, chamber, experiment == STEP_RESPONSE ? VACUUM : POSITIVE);
    for (int k = 0; k < 200; k++) {
      plant_connect(plant, 0.02 * k, experiment == LOCOMOTION ? k % CHAMBERS : chamber, k % 2 ? POSITIVE : VACUUM);
    }
    plant_move(plant, 0.2, 0.05, 0.02, experiment == STATIC_LOADING);
    plant_record(plant, 0, 0.01, ROWS, rows);
    if (!isfinite(rows[ROWS - 1].head_m) || !isfinite(plant_energy(plant))) return 1;
  }
  return 0;
}

static void run(Uno *uno, double seconds) {
  UnoStatus status;
  uno_status(uno, &status);
  uno_run(uno, status.cycle + (uint64_t)(seconds * 16e6), 0);
}

static void say(Uno *uno, const char *line, double baud) {
  int size = 0;
  while (line[size]) size++;
  uno_uart_send(uno, (const uint8_t *)line, size, baud);
}

static int try_board(Plant *plant, PlantSample *rows, const char *image) {
  char error[256];
  Uno *uno = uno_new(image, error, sizeof error);
  if (uno == NULL) return puts(error);
  plant_wire(plant, 0, 16e6, 3, 0.06, 0.01);
  UnoWorld world = {plant, plant_pin_changed_address(), plant_analog_volts_address(), plant_dac_changed_address()};
  uno_connect(uno, &world);
  uno_keep_events(uno, 1);
  run(uno, 1.0);
  plant_remount(plant, LOCOMOTION, BODY, 16000000);
  plant_watch(plant, 0.01, 0.003);
  say(uno, "run\nstatus\n", 250000);
  run(uno, 4.0);
  say(uno, "garbled at another speed\n", 115200);
  for (int i = 0; i < 6; i++) {
    uno_reset(uno, i % 3);
    uno_set_input(uno, 2, i & 1);
    uno_set_bus(uno, i % 3);
    plant_break_sensor(plant, i % 4, i & 1 ? 5.0 : NAN);
    run(uno, 0.3);
  }
  uno_set_bus(uno, UNO_DAC_PRESENT);
  say(uno, "load baseline\nsave\nset period_s 3\nsave\n", 250000);
  uno_eeprom_cut_power(uno, 3, 0.4);
  run(uno, 2.0);
  uno_reset(uno, UNO_RESET_POWER_ON);
  run(uno, 2.0);
  uint8_t bytes[1024];
  uint64_t cycles[1024];
  UnoEvent events[64];
  double strobes[64];
  while (uno_uart_receive(uno, bytes, cycles, 1024) > 0) continue;
  for (int first = 0, count; (count = uno_events(uno, events, first, 64)) > 0; first += count) continue;
  while (plant_strobes(plant, strobes, 64) > 0) continue;
  while (plant_watched(plant, rows, ROWS) > 0) continue;
  uno_eeprom_read(uno, bytes, sizeof bytes);
  uno_peek_ram(uno, 0x8F0, bytes, 64);
  uno_untouched_ram(uno, 0x100);
  uno_free(uno);
  return 0;
}

// All effects at once, in every experiment.
static int try_foreign(void) {
  const ForeignSpring truss = {0.04, 0.031, 6800, 0.2, 0.5, 97, 0.003, 40, 0.003, 0.005, 0.025, 0.054};
  ForeignRobot r = {
      .spring = {truss, truss},
      .damping_Ns_m = {130, 15},
      .area_N_psi = {9, 3.2},
      .alpha_n_per_s = {2, 2.3},
      .alpha_s_per_s = {0.6, 0.8},
      .half_mass_kg = {0.175, 0.175},
      .stand_mass_kg = 0.05,
      .small_mass_kg = 0.015,
      .segment_mass_kg = 0.1,
      .wall_offset_m = 0.05,
      .wall_N_m = 8000,
      .wall_Ns_m = 20,
      .mu_s = 0.45,
      .mu_k = 0.38,
      .load_cell_N_m = 5000,
      .positive_psi = 8.5,
      .negative_psi = -13,
      .friction_factor = 1,
      .bouc_N = {4, 1},
      .bouc_m = 0.002,
      .bouc_beta = 0.7,
      .bouc_power = 2,
      .slip_N = {4, 1},
      .slip_m = {0.0005, 0.001, 0.002, 0.004},
      .slip_share = {0.25, 0.25, 0.25, 0.25},
      .prony_N_m = {150, 60},
      .prony_s = {0.1, 1, 10},
      .prony_share = {0.3, 0.3, 0.4},
      .area_slope = 0.05,
      .area_form = 1,
      .opening_s = 0.01,
      .line_s = 0.03,
      .line_damping = 0.8,
      .throat_per_s = 5,
      .throat_ratio = 0.3,
      .throat_by_volume = 1,
      .orifice_per_s = 0.02,
      .check_per_s = 0.02,
      .check_psi = 1,
      .reservoir_share = {0.05, 0.05},
      .recharge_s = {0.3, 0.3},
      .hunt_psi = 0.2,
      .hunt_Hz = 0.5,
      .hunt_skew = 0.3,
      .sensor_s = 0.03,
      .sensor_damping = 0.8,
      .drop_share = 0.02,
      .drop_power = 1.75,
      .stribeck_m_s = 0.01,
      .direction_static = 0.05,
      .direction_kinetic = 0.1,
      .slope_rad = 0.05,
      .slope_rad_m = 0.05,
      .tether_N = 1,
      .tether_m = 0.3,
      .thermal_share = 0.1,
      .thermal_s = 1,
      .warm_share = 0.2,
      .warm_s = 10,
      .warm_W = 0.5,
      .creep_m_s = 1e-5,
      .creep_psi = 3,
      .creep_limit_m = 0.003,
      .bore_m = 0.0005,
      .bore_wave_m = {0.15, 0.05},
      .seam_rise = 0.3,
      .seam_spacing_m = 0.02,
      .seam_width_m = 0.005,
  };
  const ForeignEdge edges[] = {{0, 0, 2}, {0, 1, 1}, {0, 2, 2}, {0.5, 2, 1}, {1, 1, 2}, {1.5, 0, 1}, {3, 0, 2}};
  double times[400];
  ForeignSample samples[400];
  int failed = 0;
  for (int i = 0; i < 400; i++) times[i] = 0.01 * i;
  for (int round = 0; round < 16; round++) {
    r.line_form = round % 3;
    r.hunt_form = r.sensor_form = r.stribeck_form = (round + 1) % 3;
    r.gap_m = round % 2 ? 0.001 : 0;
    for (int i = 0; i < 3; i++) r.play_m[i] = round % 4 == 2 ? 0.0003 * (i + 1) : 0;
    int experiment = round % 4, moved = experiment > 1;
    ForeignTrial trial = {.experiment = experiment, .chamber = round / 4 % 2, .start = round % 3, .tolerance = 1};
    trial.travel_m = moved ? 0.04 : 0;
    trial.rate_m_s = moved ? 0.02 : 0;
    trial.there_and_back = experiment == 2;
    failed += foreign_run(&r, &trial, edges, moved ? 0 : 7, times, 400, samples);
  }
  foreign_throat(1, 0.3, foreign_spring(&truss, 0.01, 0), 0);
  return failed;
}

int main(int count, char **arguments) {
  PlantSample *rows = malloc(ROWS * sizeof *rows);
  Plant *plant = make_plant();
  int failed = count < 2 || try_stands(plant, rows) || try_foreign() || try_board(plant, rows, arguments[1]);
  plant_free(plant);
  free(rows);
  return failed;
}
