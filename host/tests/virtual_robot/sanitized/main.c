// SPDX-License-Identifier: GPL-3.0-or-later
// Calls every entry point of plant.h, foreign.h and uno.h at least once, under AddressSanitizer and UBSan.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "foreign.h"
#include "plant.h"
#include "robots.h"  // constants written by the test: PLANT with its springs, FOREIGN
#include "uno.h"

enum { ROWS = 800 };
#define COUNT(array) (sizeof array / sizeof *array)

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
  uno_uart_send(uno, (const uint8_t *)line, (int)strlen(line), baud);
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

static int try_foreign(void) {
  const ForeignEdge edges[] = {{0, 0, 2}, {0, 1, 1}, {0, 2, 2}, {0.5, 2, 1}, {1, 1, 2}, {1.5, 0, 1}, {3, 0, 2}};
  double times[400];
  ForeignSample samples[400];
  int failed = 0;
  for (int i = 0; i < 400; i++) times[i] = 0.01 * i;
  for (int round = 0; round < 4 * (int)COUNT(FOREIGN); round++) {
    int experiment = round % 4, moved = experiment > 1;
    ForeignTrial trial = {.experiment = experiment, .chamber = round / 4 % 2, .start = round % 3, .tolerance = 1};
    trial.travel_m = moved ? 0.04 : 0;
    trial.rate_m_s = moved ? 0.02 : 0;
    trial.there_and_back = experiment == 2;
    failed += foreign_run(&FOREIGN[round / 4], &trial, edges, moved ? 0 : 7, times, 400, samples);
  }
  foreign_throat(1, 0.3, foreign_spring(&FOREIGN[0].spring[0], 0.01, 0), 0);
  return failed;
}

int main(int count, char **arguments) {
  PlantSample *rows = malloc(ROWS * sizeof *rows);
  Plant *plant = plant_new(&PLANT, BODY_FORCE_N, COUNT(BODY_FORCE_N), BODY_FIRST_M, BODY_STEP_M, SMALL_FORCE_N,
                           COUNT(SMALL_FORCE_N), SMALL_FIRST_M, SMALL_STEP_M);
  int failed = count < 2 || try_stands(plant, rows) || try_foreign() || try_board(plant, rows, arguments[1]);
  plant_free(plant);
  free(rows);
  return failed;
}
