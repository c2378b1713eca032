// SPDX-License-Identifier: GPL-3.0-or-later
// Two-wire master (datasheet section 21) with an MCP4725 at 0x62 (DS22039) as the only slave. Bit times follow
// TWBR, an absent address is not acknowledged, and a stuck bus does not answer at all.
#include "board.h"

enum { TWINT = 0x80, TWEA = 0x40, TWSTA = 0x20, TWSTO = 0x10, TWWC = 0x08, TWEN = 0x04, TWIE = 0x01 };
enum {
  STATUS_START = 0x08,
  STATUS_REPEATED_START = 0x10,
  STATUS_WRITE_ADDRESS_ACK = 0x18,
  STATUS_WRITE_ADDRESS_NACK = 0x20,
  STATUS_WRITE_ACK = 0x28,
  STATUS_WRITE_NACK = 0x30,
  STATUS_READ_ADDRESS_ACK = 0x40,
  STATUS_READ_ADDRESS_NACK = 0x48,
  STATUS_READ_ACK = 0x50,
  STATUS_READ_NACK = 0x58,
  STATUS_IDLE = 0xF8
};
#define MCP4725_ADDRESS 0x62

static uint32_t clock_cycles(const Uno *uno) {
  static const uint8_t prescaler[] = {1, 4, 16, 64};
  const uint8_t *data = uno->avr->data;
  return 16 + 2 * (uint32_t)data[REG_TWBR] * prescaler[data[REG_TWSR] & 3];
}

static void set_status(Uno *uno, uint8_t status) {
  uno->twi.status = status;
  uno->avr->data[REG_TWSR] = status | (uno->avr->data[REG_TWSR] & 3);
}

static void raise_level(Uno *uno) {
  uint8_t control = uno->avr->data[REG_TWCR];
  if (control & TWINT && control & TWIE) avr_raise_interrupt(uno->avr, uno->vector[VECTOR_TWI]);
}

static void on_return(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  if (value == 0) raise_level(param);
}

static avr_cycle_count_t action_done(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  Uno *uno = param;
  set_status(uno, uno->twi.next_status);
  if (uno->twi.next_status == STATUS_READ_ACK || uno->twi.next_status == STATUS_READ_NACK) {
    avr->data[REG_TWDR] = uno->twi.next_data;
  }
  avr->data[REG_TWCR] |= TWINT;
  raise_level(uno);
  return 0;
}

static void finish_after(Uno *uno, uint32_t bits, uint8_t status) {
  if (uno->twi.mode == UNO_BUS_STUCK || uno->twi.held) return;
  uno->twi.next_status = status;
  chip_at(uno, uno->avr->cycle + bits * clock_cycles(uno), action_done);
}

static void begin_start(Uno *uno) {
  Twi *twi = &uno->twi;
  finish_after(uno, 1, twi->owned ? STATUS_REPEATED_START : STATUS_START);
  twi->owned = true;
  twi->expects_address = true;
  twi->addressed = false;
}

static avr_cycle_count_t stop_done(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  Uno *uno = param;
  avr->data[REG_TWCR] &= ~TWSTO;
  uno->twi.stop_pending = false;
  if (uno->twi.start_after_stop) {
    uno->twi.start_after_stop = false;
    begin_start(uno);
  }
  return 0;
}

static void set_output(Uno *uno, int code) {
  uno->twi.dac_code = code;
  events_add(uno, UNO_EVENT_DAC, 0, code);
  if (uno->world.dac_changed) uno->world.dac_changed(uno->world.context, uno->avr->cycle, code);
}

// DS22039 section 6: fast mode (two bytes) or a command byte and two data bytes; both may repeat.
static void dac_byte(Uno *uno, uint8_t byte) {
  Twi *twi = &uno->twi;
  if (twi->byte_index == 0) {
    twi->command = byte >> 5;
    twi->first_byte = byte;
    twi->byte_index = 1;
  } else if (twi->command <= 1) {  // fast mode: PD1 PD0 D11..D8, D7..D0
    bool powered_down = twi->first_byte & 0x30;
    set_output(uno, powered_down ? 0 : (twi->first_byte & 0x0F) << 8 | byte);
    twi->byte_index = 0;
  } else if (twi->byte_index == 1) {
    twi->first_byte = byte;
    twi->byte_index = 2;
  } else {
    set_output(uno, twi->first_byte << 4 | byte >> 4);
    if (twi->command == 3) twi->dac_eeprom_writes++;
    twi->byte_index = 0;
  }
}

static uint8_t dac_answer(Twi *twi) {
  uint8_t answer[] = {0xC0, (uint8_t)(twi->dac_code >> 4), (uint8_t)(twi->dac_code << 4), 0, 0};
  return answer[twi->byte_index < 4 ? twi->byte_index++ : 4];
}

static void transfer(Uno *uno) {
  Twi *twi = &uno->twi;
  uint8_t data = uno->avr->data[REG_TWDR];
  if (twi->expects_address) {
    twi->expects_address = false;
    twi->reading = data & 1;
    twi->addressed = (twi->mode == UNO_DAC_PRESENT || twi->mode == UNO_BUS_HELD) && data >> 1 == MCP4725_ADDRESS;
    twi->byte_index = 0;
    uint8_t ack = twi->reading ? STATUS_READ_ADDRESS_ACK : STATUS_WRITE_ADDRESS_ACK;
    uint8_t nack = twi->reading ? STATUS_READ_ADDRESS_NACK : STATUS_WRITE_ADDRESS_NACK;
    finish_after(uno, 9, twi->addressed ? ack : nack);
  } else if (twi->reading) {
    twi->next_data = twi->addressed ? dac_answer(twi) : 0xFF;
    finish_after(uno, 9, uno->avr->data[REG_TWCR] & TWEA ? STATUS_READ_ACK : STATUS_READ_NACK);
  } else {
    if (twi->addressed) dac_byte(uno, data);
    finish_after(uno, 9, twi->addressed ? STATUS_WRITE_ACK : STATUS_WRITE_NACK);
  }
}

static void cancel(Uno *uno) {
  avr_cycle_timer_cancel(uno->avr, action_done, uno);
  avr_cycle_timer_cancel(uno->avr, stop_done, uno);
  uno->twi.owned = uno->twi.stop_pending = uno->twi.start_after_stop = false;
}

static void twcr_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  Uno *uno = param;
  Twi *twi = &uno->twi;
  uint8_t flag = avr->data[address] & TWINT;
  if (value & TWINT) {
    flag = 0;
    uno->vector[VECTOR_TWI]->pending = 0;
  }
  avr->data[address] = (value & ~(TWINT | TWSTO | TWWC)) | flag | (twi->stop_pending ? TWSTO : 0);
  if (!(value & TWEN)) {
    cancel(uno);
    set_status(uno, STATUS_IDLE);
    return;
  }
  if (!(value & TWINT)) {
    raise_level(uno);
    return;
  }
  if (value & TWSTO) {
    avr->data[address] |= TWSTO;
    twi->stop_pending = true;
    twi->start_after_stop = value & TWSTA;
    twi->owned = false;
    set_status(uno, STATUS_IDLE);
    twi->held |= twi->mode == UNO_BUS_HELD;
    if (twi->mode != UNO_BUS_STUCK && !twi->held) chip_at(uno, avr->cycle + clock_cycles(uno), stop_done);
  } else if (value & TWSTA) {
    if (twi->stop_pending) {
      twi->start_after_stop = true;
    } else {
      begin_start(uno);
    }
  } else if (twi->owned) {
    transfer(uno);
  }
}

static void twsr_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  avr->data[address] = ((Uno *)param)->twi.status | (value & 3);
}

void twi_attach(Uno *uno) {
  chip_take_register(uno, REG_TWCR, NULL, twcr_write);
  chip_take_register(uno, REG_TWSR, NULL, twsr_write);
  chip_take_register(uno, REG_TWBR, NULL, NULL);
  chip_take_register(uno, REG_TWDR, NULL, NULL);
  chip_on_return(uno, VECTOR_TWI, on_return);
}

void twi_after_reset(Uno *uno) {
  Twi *twi = &uno->twi;
  twi->owned = twi->stop_pending = twi->start_after_stop = twi->addressed = false;
  uno->avr->data[REG_TWDR] = 0xFF;
  uno->avr->data[REG_TWCR] = 0;
  uno->avr->data[REG_TWSR] = 0;
  set_status(uno, STATUS_IDLE);
}

void uno_set_bus(Uno *uno, int mode) {
  uno->twi.mode = mode;
  uno->twi.held = false;
}
