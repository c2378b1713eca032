// SPDX-License-Identifier: GPL-3.0-or-later
// The cables between Uno and plant: valve pins, sampling strobe, pressure sensors, DAC and regulator monitor; also the
// instruments that record at the same time.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "parts.h"

#define STROBE_PIN 10
#define SUPPLY_VOLTS 5.0
#define REGULATOR_SPAN_PSI 130.0  // ITV1050: 0.9 MPa for 5 V in; 1-5 V monitor out
#define DAC_COUNTS 4096.0

typedef struct Wires {
  uint64_t start_cycle;
  double clock_hz;
  uint64_t random;
  double spare_gauss;
  bool has_spare;
  double noise_psi, noise_memory_s;
  double noise[CHAMBERS], noise_time[CHAMBERS];  // unit variance; time of the last draw
  double broken_volts[4];
  bool energised[CHAMBERS][2];  // positive, vacuum valve
  int both;
  double *strobes;
  int strobe_count, strobe_capacity;
  double watch_period, watch_offset;
  long watch_next;
  PlantSample *watched;
  int watched_count, watched_capacity;
} Wires;

static uint64_t splitmix(uint64_t *state) {
  uint64_t z = (*state += 0x9E3779B97F4A7C15ull);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

static double uniform(Wires *wires) { return ((splitmix(&wires->random) >> 11) + 0.5) / 9007199254740992.0; }

static double gauss(Wires *wires) {  // Box-Muller
  if (wires->has_spare) {
    wires->has_spare = false;
    return wires->spare_gauss;
  }
  double radius = sqrt(-2 * log(uniform(wires))), angle = 2 * M_PI * uniform(wires);
  wires->spare_gauss = radius * sin(angle);
  wires->has_spare = true;
  return radius * cos(angle);
}

void plant_wire(Plant *plant, uint64_t start_cycle, double clock_hz, uint64_t noise_seed, double noise_psi,
                double noise_memory_s) {
  wires_free(plant);
  Wires *wires = calloc(1, sizeof *wires);
  wires->start_cycle = start_cycle;
  wires->clock_hz = clock_hz;
  wires->random = noise_seed;
  wires->noise_psi = noise_psi;
  wires->noise_memory_s = noise_memory_s;
  for (int i = 0; i < 4; i++) wires->broken_volts[i] = NAN;
  plant->wires = wires;
}

// Both valves at once connect supply and vacuum; the chamber then counts as vented (pin_changed() counts these cases).
static int connected(const bool *energised) {
  if (energised[0] == energised[1]) return VENT;
  return energised[0] ? POSITIVE : VACUUM;
}

void plant_remount(Plant *plant, int experiment, int chamber, uint64_t cycle) {
  Wires *wires = plant->wires;
  wires->start_cycle = cycle;
  wires->strobe_count = wires->watched_count = 0;
  wires->watch_period = 0;
  plant_mount(plant, experiment, chamber, VENT);
  for (int i = 0; i < CHAMBERS; i++) plant_connect(plant, 0, i, connected(wires->energised[i]));
}

void wires_free(Plant *plant) {
  if (plant->wires == NULL) return;
  free(plant->wires->strobes);
  free(plant->wires->watched);
  free(plant->wires);
  plant->wires = NULL;
}

static double seconds(const Plant *plant, uint64_t cycle) {
  return (double)(int64_t)(cycle - plant->wires->start_cycle) / plant->wires->clock_hz;
}

static void on_strobe(Wires *wires, double time) {
  if (wires->strobe_count == wires->strobe_capacity) {
    wires->strobe_capacity = wires->strobe_capacity ? 2 * wires->strobe_capacity : 1024;
    wires->strobes = realloc(wires->strobes, wires->strobe_capacity * sizeof *wires->strobes);
  }
  wires->strobes[wires->strobe_count++] = time;
}

static void pin_changed(void *context, uint64_t cycle, int pin, int level) {
  Plant *plant = context;
  Wires *wires = plant->wires;
  double time = seconds(plant, cycle);
  if (pin == STROBE_PIN && level) on_strobe(wires, time);
  if (pin < 4 || pin > 9) return;
  int chamber = (pin - 4) / 2;
  bool *energised = wires->energised[chamber];
  energised[(pin - 4) % 2] = level;
  if (energised[0] && energised[1]) wires->both++;
  plant_connect(plant, fmax(time, plant->time), chamber, connected(energised));
}

// An Ornstein-Uhlenbeck process, sampled whenever the converter samples.
static double sensor_noise(Wires *wires, int chamber, double time) {
  double kept = 0;
  if (wires->noise_memory_s > 0) kept = exp(-fabs(time - wires->noise_time[chamber]) / wires->noise_memory_s);
  wires->noise[chamber] = kept * wires->noise[chamber] + sqrt(1.0 - kept * kept) * gauss(wires);
  wires->noise_time[chamber] = time;
  return wires->noise_psi * wires->noise[chamber];
}

// ABPDRRV015PDAA5: 10-90 % of the supply over +-15 psi, never beyond 2.5-97.5 %.
static double sensor_volts(Plant *plant, int chamber) {
  Wires *wires = plant->wires;
  double psi = reading_psi(plant, plant->time, plant->y, chamber) + sensor_noise(wires, chamber, plant->time);
  double share = 0.1 + 0.8 * (psi + 15.0) / 30.0;
  return SUPPLY_VOLTS * fmin(fmax(share, 0.025), 0.975);
}

static double analog_volts(void *context, uint64_t cycle, int channel) {
  Plant *plant = context;
  Wires *wires = plant->wires;
  plant_advance(plant, seconds(plant, cycle));
  if (channel < 4 && !isnan(wires->broken_volts[channel])) return wires->broken_volts[channel];
  if (channel < CHAMBERS) return sensor_volts(plant, channel);
  if (channel == 3) return 1.0 + 4.0 * supply_psi(plant, plant->time, plant->y, POSITIVE) / REGULATOR_SPAN_PSI;
  return 0.0;
}

static void dac_changed(void *context, uint64_t cycle, int code) {
  Plant *plant = context;
  plant_advance(plant, seconds(plant, cycle));
  plant_set_supply(plant, code / DAC_COUNTS * REGULATOR_SPAN_PSI);
}

void *plant_pin_changed_address(void) { return (void *)pin_changed; }
void *plant_analog_volts_address(void) { return (void *)analog_volts; }
void *plant_dac_changed_address(void) { return (void *)dac_changed; }

void plant_break_sensor(Plant *plant, int channel, double volts) { plant->wires->broken_volts[channel] = volts; }

int plant_both_valves(const Plant *plant) { return plant->wires->both; }

int plant_strobes(Plant *plant, double *times_s, int capacity) {
  Wires *wires = plant->wires;
  int count = wires->strobe_count < capacity ? wires->strobe_count : capacity;
  memcpy(times_s, wires->strobes, count * sizeof *times_s);
  memmove(wires->strobes, wires->strobes + count, (wires->strobe_count - count) * sizeof *times_s);
  wires->strobe_count -= count;
  return count;
}

void plant_watch(Plant *plant, double period_s, double offset_s) {
  Wires *wires = plant->wires;
  wires->watch_period = period_s;
  wires->watch_offset = offset_s;
  wires->watch_next = 0;
  wires->watched_count = 0;
}

double next_watch(const Plant *plant) {
  const Wires *wires = plant->wires;
  if (wires == NULL || wires->watch_period <= 0) return INFINITY;
  return wires->watch_offset + wires->watch_next * wires->watch_period;
}

void watch_now(Plant *plant) {
  Wires *wires = plant->wires;
  if (wires->watched_count == wires->watched_capacity) {
    wires->watched_capacity = wires->watched_capacity ? 2 * wires->watched_capacity : 1024;
    wires->watched = realloc(wires->watched, wires->watched_capacity * sizeof *wires->watched);
  }
  plant_sample(plant, &wires->watched[wires->watched_count++]);
  wires->watch_next++;
}

int plant_watched(Plant *plant, PlantSample *samples, int capacity) {
  Wires *wires = plant->wires;
  int count = wires->watched_count < capacity ? wires->watched_count : capacity;
  memcpy(samples, wires->watched, count * sizeof *samples);
  memmove(wires->watched, wires->watched + count, (wires->watched_count - count) * sizeof *samples);
  wires->watched_count -= count;
  return count;
}
