// SPDX-License-Identifier: GPL-3.0-or-later
// The Uno's digital pins with exact cycle stamps. Levels are taken from PORT and DDR themselves, so a pin
// released by a reset or a cleared DDR bit is seen to fall; libsimavr's own pin signals do not report that.
#include "board.h"

static const char port_name[PORT_COUNT] = {'B', 'C', 'D'};
static const uint8_t port_pin_register[PORT_COUNT] = {REG_PINB, REG_PINC, REG_PIND};
static const uint8_t first_pin[PORT_COUNT] = {8, 14, 0};

static void locate(int pin, int *port, int *bit) {
  *port = pin < 8 ? 2 : pin < 14 ? 0 : 1;
  *bit = pin - first_pin[*port];
}

// Reports changed levels. A gate pull-down makes a pin that is not driven low. `outputs`: DDR; `levels`: PORT & DDR.
static void announce(Uno *uno, int port, uint8_t outputs, uint8_t levels) {
  uint8_t changed = levels ^ uno->driven[port];
  uno->driven[port] = levels;
  uno->direction[port] = outputs;
  for (int bit = 0; bit < 8; bit++) {
    if (!(changed >> bit & 1)) continue;
    int pin = first_pin[port] + bit, level = levels >> bit & 1;
    events_add(uno, UNO_EVENT_PIN, pin, level);
    if (uno->world.pin_changed) {
      uno->world.pin_changed(uno->world.context, uno->avr->cycle, pin, level);
    }
  }
}

static void update(Uno *uno, int port) {
  uint8_t outputs = uno->avr->data[port_pin_register[port] + 1];
  uint8_t latch = uno->avr->data[port_pin_register[port] + 2];
  if (port == 0) latch = compare_overrides(uno, latch);
  announce(uno, port, outputs, outputs & latch);
}

void pins_update_port_b(Uno *uno) { update(uno, 0); }

static void port_written(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  Uno *uno = param;
  int port = (address - REG_PINB) / 3;
  WrappedWrite *behind = &uno->port_write[address - REG_PINB];
  behind->write(avr, address, value, behind->param);
  update(uno, port);
}

// The level wired to an input overrides its pull-up. libsimavr would raise pulled-up pins at each PORT write.
static void tell_external(Uno *uno, int port) {
  avr_ioport_external_t external = {.name = port_name[port], .mask = uno->wired[port], .value = uno->input[port]};
  avr_ioctl(uno->avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port_name[port]), &external);
}

void pins_attach(Uno *uno) {
  for (int reg = REG_PINB; reg <= REG_PORTD; reg++) {
    WrappedWrite *behind = &uno->port_write[reg - REG_PINB];
    behind->write = uno->avr->io[AVR_DATA_TO_IO(reg)].w.c;
    behind->param = uno->avr->io[AVR_DATA_TO_IO(reg)].w.param;
    uno->avr->io[AVR_DATA_TO_IO(reg)].w.c = port_written;
    uno->avr->io[AVR_DATA_TO_IO(reg)].w.param = uno;
  }
  for (int pin = 0; pin <= 2; pin++) uno_set_input(uno, pin, 1);  // idle serial lines, emergency stop released
}

void pins_release(Uno *uno) {
  for (int port = 0; port < PORT_COUNT; port++) announce(uno, port, 0, 0);
}

void pins_after_reset(Uno *uno) {
  pins_release(uno);
  for (int port = 0; port < PORT_COUNT; port++) {
    tell_external(uno, port);
    uno->avr->data[port_pin_register[port]] = uno->input[port];
  }
}

int uno_pin(const Uno *uno, int pin) {
  int port, bit;
  locate(pin, &port, &bit);
  if (!(uno->direction[port] >> bit & 1)) return -1;
  return uno->driven[port] >> bit & 1;
}

void uno_set_input(Uno *uno, int pin, int level) {
  int port, bit;
  locate(pin, &port, &bit);
  uno->wired[port] |= 1u << bit;
  uno->input[port] = (uno->input[port] & ~(1u << bit)) | (level ? 1u << bit : 0);
  tell_external(uno, port);
  avr_irq_t *irq = avr_io_getirq(uno->avr, AVR_IOCTL_IOPORT_GETIRQ(port_name[port]), bit);
  if (!(uno->direction[port] >> bit & 1)) avr_raise_irq(irq, level ? 1 : 0);
}
