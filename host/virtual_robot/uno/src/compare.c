// SPDX-License-Identifier: GPL-3.0-or-later
// D10 as OC1B, the pin that timer 1 sets and clears by itself (datasheet section 15.7): libsimavr reports matches,
// but neither drives the pin nor implements the forced match.
#include "avr_timer.h"
#include "board.h"

enum { OC1B_ON_PORT_B = 0x04, COM1B_SHIFT = 4, FOC1B = 0x40 };

static int mode(const Uno *uno) { return uno->avr->data[REG_TCCR1A] >> COM1B_SHIFT & 3; }

static void match(Uno *uno) {
  switch (mode(uno)) {
    case avr_timer_com_toggle:
      uno->compare.level = !uno->compare.level;
      break;
    case avr_timer_com_clear:
      uno->compare.level = false;
      break;
    case avr_timer_com_set:
      uno->compare.level = true;
      break;
    default:
      return;
  }
  pins_update_port_b(uno);
}

static void on_match(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  (void)value;
  match(param);
}

static void tccr1a_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  Uno *uno = param;
  uno->compare.behind.write(avr, address, value, uno->compare.behind.param);
  pins_update_port_b(uno);
}

static void tccr1c_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  avr->data[address] = 0;
  if (value & FOC1B) match(param);
}

uint8_t compare_overrides(const Uno *uno, uint8_t latch) {
  if (mode(uno) == avr_timer_com_normal) return latch;
  return (latch & ~OC1B_ON_PORT_B) | (uno->compare.level ? OC1B_ON_PORT_B : 0);
}

void compare_attach(Uno *uno) {
  avr_irq_t *irq = avr_io_getirq(uno->avr, AVR_IOCTL_TIMER_GETIRQ('1'), TIMER_IRQ_OUT_COMP + AVR_TIMER_COMPB);
  irq->flags &= ~IRQ_FLAG_FILTERED;  // every match counts, even one that repeats the last level
  avr_irq_register_notify(irq, on_match, uno);
  avr_io_addr_t io = AVR_DATA_TO_IO(REG_TCCR1A);
  uno->compare.behind.write = uno->avr->io[io].w.c;
  uno->compare.behind.param = uno->avr->io[io].w.param;
  uno->avr->io[io].w.c = tccr1a_write;
  uno->avr->io[io].w.param = uno;
  chip_take_register(uno, REG_TCCR1C, NULL, tccr1c_write);
}

void compare_after_reset(Uno *uno) { uno->compare.level = false; }
