// SPDX-License-Identifier: GPL-3.0-or-later
// Drives every entry point of plant.h and uno.h once or more, for AddressSanitizer and UBSan to watch.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

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
  plant_wire(plant, 0, 16e6, 3, 0.06);
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
  uno_peek_flash(uno, 0x7FF0, bytes, 64);
  uno_untouched_ram(uno, 0x100);
  uno_free(uno);
  return 0;
}

int main(int count, char **arguments) {
  PlantSample *rows = malloc(ROWS * sizeof *rows);
  Plant *plant = make_plant();
  int failed = count < 2 || try_stands(plant, rows) || try_board(plant, rows, arguments[1]);
  plant_free(plant);
  free(rows);
  return failed;
}
