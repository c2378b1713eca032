// SPDX-License-Identifier: GPL-3.0-or-later
// EEPROM (datasheet section 8.4): a write takes 3.4 ms, continues through a reset, and stays incomplete if the
// power fails during it. Replaces libsimavr's instantaneous writes, but uses its byte array.
#include <string.h>

#include "avr_eeprom.h"
#include "board.h"

enum { EERE = 0x01, EEPE = 0x02, EEMPE = 0x04, EERIE = 0x08, EEPM = 0x30 };

static uint64_t write_cycles(uint8_t mode) {
  // 3.4 ms to erase and write, 1.8 ms for either alone
  return mode == 0 ? CLOCK_HZ / 10000 * 34 : CLOCK_HZ / 10000 * 18;
}

static void raise_level(Uno *uno) {
  uint8_t control = uno->avr->data[REG_EECR];
  if (!(control & EEPE) && control & EERIE) {
    avr_raise_interrupt(uno->avr, uno->vector[VECTOR_EE_READY]);
  } else {
    uno->vector[VECTOR_EE_READY]->pending = 0;
  }
}

static void on_return(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  if (value == 0) raise_level(param);
}

static avr_cycle_count_t write_done(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  Uno *uno = param;
  Eeprom *eeprom = &uno->eeprom;
  eeprom->bytes[eeprom->address] = eeprom->new_value;
  eeprom->writing = false;
  avr->data[REG_EECR] &= ~EEPE;
  events_add(uno, UNO_EVENT_EEPROM, eeprom->address, eeprom->new_value);
  raise_level(uno);
  return 0;
}

// The cell is first erased (bits rise to 1 one after another), then programmed (bits fall to 0).
static avr_cycle_count_t power_fails(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr;
  (void)when;
  Uno *uno = param;
  Eeprom *eeprom = &uno->eeprom;
  double progress = 2.0 * eeprom->cut_fraction;
  bool erasing = progress < 1.0;
  int flipped = (int)(8.0 * (erasing ? progress : progress - 1.0));
  uint8_t value = erasing ? eeprom->old_value : 0xFF;
  for (int bit = 0; bit < flipped && bit < 8; bit++) {
    uint8_t mask = 1u << (bit * 3 % 8);  // not in bit order
    value = erasing ? value | mask : value & (eeprom->new_value | (uint8_t)~mask);
  }
  eeprom->bytes[eeprom->address] = value;
  eeprom->writing = false;
  events_add(uno, UNO_EVENT_EEPROM, eeprom->address, value);
  uno_power_off(uno);
  return 0;
}

static void begin_write(Uno *uno, uint16_t address, uint8_t mode) {
  Eeprom *eeprom = &uno->eeprom;
  avr_t *avr = uno->avr;
  uint8_t wanted = avr->data[REG_EEDR];
  eeprom->address = address;
  eeprom->old_value = eeprom->bytes[address];
  eeprom->new_value = mode == 1 ? 0xFF : mode == 2 ? eeprom->old_value & wanted : wanted;
  eeprom->writing = true;
  eeprom->start_cycle = avr->cycle;
  eeprom->done_cycle = avr->cycle + write_cycles(mode);
  eeprom->cut_cycle = 0;
  eeprom->writes++;
  avr->cycle += 2;  // the CPU is halted for two cycles
  if (eeprom->cut_after > 0 && --eeprom->cut_after == 0) {
    eeprom->cut_cycle = eeprom->start_cycle + (uint64_t)(eeprom->cut_fraction * (double)write_cycles(mode));
    chip_at(uno, eeprom->cut_cycle, power_fails);
  } else {
    chip_at(uno, eeprom->done_cycle, write_done);
  }
}

static avr_cycle_count_t master_enable_ends(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  (void)param;
  avr->data[REG_EECR] &= ~EEMPE;
  return 0;
}

static void eecr_write(avr_t *avr, avr_io_addr_t control, uint8_t value, void *param) {
  Uno *uno = param;
  Eeprom *eeprom = &uno->eeprom;
  bool enabled = avr->data[control] & EEMPE;
  uint16_t address = (avr->data[REG_EEARL] | avr->data[REG_EEARH] << 8) & (eeprom->size - 1);
  uint8_t mode = eeprom->writing ? avr->data[control] & EEPM : value & EEPM;
  avr->data[control] = mode | (value & EERIE) | (enabled ? EEMPE : 0) | (eeprom->writing ? EEPE : 0);
  if (value & EEMPE && !enabled) {
    avr->data[control] |= EEMPE;
    avr_cycle_timer_register(avr, 5, master_enable_ends, uno);
  }
  if (value & EEPE && enabled && !eeprom->writing) {
    avr->data[control] = (avr->data[control] & ~EEMPE) | EEPE;
    begin_write(uno, address, mode >> 4);
  }
  if (value & EERE && !eeprom->writing) {
    avr->data[REG_EEDR] = eeprom->bytes[address];
    avr->cycle += 4;  // the CPU is halted for four cycles
  }
  raise_level(uno);
}

void eeprom_attach(Uno *uno) {
  avr_eeprom_desc_t whole = {.ee = NULL, .offset = 0, .size = 0};
  avr_ioctl(uno->avr, AVR_IOCTL_EEPROM_GET, &whole);
  uno->eeprom.bytes = whole.ee;
  uno->eeprom.size = uno->avr->e2end + 1;
  chip_take_register(uno, REG_EECR, NULL, eecr_write);
  chip_on_return(uno, VECTOR_EE_READY, on_return);
}

void eeprom_after_reset(Uno *uno) {
  Eeprom *eeprom = &uno->eeprom;
  if (!eeprom->writing) return;
  uno->avr->data[REG_EECR] |= EEPE;
  if (eeprom->cut_cycle) {
    chip_at(uno, eeprom->cut_cycle, power_fails);
  } else {
    chip_at(uno, eeprom->done_cycle, write_done);
  }
}

void uno_eeprom_read(const Uno *uno, uint8_t *bytes, int size) {
  memcpy(bytes, uno->eeprom.bytes, size < uno->eeprom.size ? size : uno->eeprom.size);
}

void uno_eeprom_load(Uno *uno, const uint8_t *bytes, int size) {
  memcpy(uno->eeprom.bytes, bytes, size < uno->eeprom.size ? size : uno->eeprom.size);
}

void uno_eeprom_cut_power(Uno *uno, int n, double fraction) {
  uno->eeprom.cut_after = n;
  uno->eeprom.cut_fraction = fraction;
}
