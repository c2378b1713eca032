// SPDX-License-Identifier: GPL-3.0-or-later
// ADC (datasheet section 23): the channel is latched at the start and held 1.5 ADC clocks later, ADIF is
// cleared by writing one, ADCL locks the result. Replaces libsimavr's model, which reads the
// multiplexer too late.
#include "board.h"

enum { ADEN = 0x80, ADSC = 0x40, ADATE = 0x20, ADIF = 0x10, ADIE = 0x08 };
#define AVCC_VOLTS 5.0
#define BANDGAP_VOLTS 1.1

static uint32_t clock_cycles(const Uno *uno) {
  static const uint8_t divisor[] = {2, 2, 4, 8, 16, 32, 64, 128};
  return divisor[uno->avr->data[REG_ADCSRA] & 7];
}

static double input_volts(Uno *uno, int mux) {
  if (mux == 14) return BANDGAP_VOLTS;
  if (mux > 7) return 0.0;
  if (uno->world.analog_volts) return uno->world.analog_volts(uno->world.context, uno->avr->cycle, mux);
  return uno->adc.volts[mux];
}

static avr_cycle_count_t hold(avr_t *avr, avr_cycle_count_t when, void *param);
static avr_cycle_count_t complete(avr_t *avr, avr_cycle_count_t when, void *param);

static void start(Uno *uno) {
  Adc *adc = &uno->adc;
  uint32_t clock = clock_cycles(uno);
  adc->converting = true;
  adc->mux = uno->avr->data[REG_ADMUX];
  adc->start_cycle = uno->avr->cycle;
  uno->avr->data[REG_ADCSRA] |= ADSC;
  chip_at(uno, adc->start_cycle + (adc->first ? 27 * clock / 2 : 3 * clock / 2), hold);
}

static avr_cycle_count_t hold(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr;
  (void)when;
  Uno *uno = param;
  Adc *adc = &uno->adc;
  double reference = adc->mux >> 6 == 3 ? BANDGAP_VOLTS : AVCC_VOLTS;
  double counts = input_volts(uno, adc->mux & 0x0F) / reference * 1024.0;
  adc->sampled = counts <= 0.0 ? 0 : counts >= 1023.0 ? 1023 : (uint16_t)counts;
  chip_at(uno, adc->start_cycle + (adc->first ? 25 : 13) * clock_cycles(uno), complete);
  return 0;
}

static avr_cycle_count_t complete(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  Uno *uno = param;
  Adc *adc = &uno->adc;
  adc->converting = adc->first = false;
  avr->data[REG_ADCSRA] &= ~ADSC;
  if (!adc->locked) {
    uint16_t result = avr->data[REG_ADMUX] & 0x20 ? adc->sampled << 6 : adc->sampled;
    avr->data[REG_ADCL] = result & 0xFF;
    avr->data[REG_ADCH] = result >> 8;
  }
  avr_raise_interrupt(avr, uno->vector[VECTOR_ADC]);
  bool free_running = avr->data[REG_ADCSRA] & ADATE && (avr->data[REG_ADCSRB] & 7) == 0;
  if (free_running) start(uno);
  return 0;
}

static void adcsra_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  Uno *uno = param;
  Adc *adc = &uno->adc;
  bool was_enabled = avr->data[address] & ADEN;
  uint8_t flag = avr->data[address] & ADIF;
  if (value & ADIF) {
    flag = 0;
    uno->vector[VECTOR_ADC]->pending = 0;
  }
  avr->data[address] = (value & ~(ADSC | ADIF)) | flag | (adc->converting ? ADSC : 0);
  if (!(value & ADEN)) {
    adc->converting = false;
    avr->data[address] &= ~ADSC;
    avr_cycle_timer_cancel(avr, hold, uno);
    avr_cycle_timer_cancel(avr, complete, uno);
    return;
  }
  if (!was_enabled) adc->first = true;
  if (value & ADSC && !adc->converting) start(uno);
  if (flag && value & ADIE) avr_raise_interrupt(avr, uno->vector[VECTOR_ADC]);
}

static uint8_t adcl_read(avr_t *avr, avr_io_addr_t address, void *param) {
  ((Uno *)param)->adc.locked = true;
  return avr->data[address];
}

static uint8_t adch_read(avr_t *avr, avr_io_addr_t address, void *param) {
  ((Uno *)param)->adc.locked = false;
  return avr->data[address];
}

static void read_only(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  (void)avr;
  (void)address;
  (void)value;
  (void)param;
}

void adc_attach(Uno *uno) {
  chip_take_register(uno, REG_ADCSRA, NULL, adcsra_write);
  chip_take_register(uno, REG_ADCSRB, NULL, NULL);
  chip_take_register(uno, REG_ADMUX, NULL, NULL);
  chip_take_register(uno, REG_ADCL, adcl_read, read_only);
  chip_take_register(uno, REG_ADCH, adch_read, read_only);
}

void adc_after_reset(Uno *uno) { uno->adc.converting = uno->adc.first = uno->adc.locked = false; }

void uno_set_analog(Uno *uno, int channel, double volts) {
  if (channel >= 0 && channel < 8) uno->adc.volts[channel] = volts;
}
