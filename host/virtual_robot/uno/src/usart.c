// SPDX-License-Identifier: GPL-3.0-or-later
// USART0 (datasheet section 19): true frame length, two-byte receive buffer with overrun, double-buffered
// transmitter, level-triggered interrupts. Replaces libsimavr's model (11 bits per byte, 64-byte buffer).
#include "board.h"

enum { RXC = 0x80, TXC = 0x40, UDRE = 0x20, FE = 0x10, DOR = 0x08, U2X = 0x02 };
enum { RXCIE = 0x80, TXCIE = 0x40, UDRIE = 0x20, RXEN = 0x10, TXEN = 0x08 };

static uint32_t cycles_per_bit(const Uno *uno) {
  const uint8_t *data = uno->avr->data;
  uint32_t divisor = (data[REG_UBRRL] | (data[REG_UBRRH] & 0x0F) << 8) + 1;
  return divisor * (data[REG_UCSRA] & U2X ? 8 : 16);
}

static uint32_t cycles_per_frame(const Uno *uno) {
  uint8_t format = uno->avr->data[REG_UCSRC];
  uint32_t data_bits = 5 + ((format >> 1) & 3);
  uint32_t parity = format & 0x20 ? 1 : 0;
  uint32_t stop_bits = format & 0x08 ? 2 : 1;
  return (1 + data_bits + parity + stop_bits) * cycles_per_bit(uno);
}

static void raise_levels(Uno *uno) {
  uint8_t a = uno->avr->data[REG_UCSRA], b = uno->avr->data[REG_UCSRB];
  if (a & RXC && b & RXCIE) avr_raise_interrupt(uno->avr, uno->vector[VECTOR_USART_RX]);
  if (a & UDRE && b & UDRIE && b & TXEN) avr_raise_interrupt(uno->avr, uno->vector[VECTOR_USART_UDRE]);
  if (a & TXC && b & TXCIE) avr_raise_interrupt(uno->avr, uno->vector[VECTOR_USART_TX]);
}

static void on_return(avr_irq_t *irq, uint32_t value, void *param) {
  (void)irq;
  if (value == 0) raise_levels(param);  // an interrupt level that persists fires again after RETI
}

static void show_head(Uno *uno) {
  Usart *usart = &uno->usart;
  uint8_t *a = &uno->avr->data[REG_UCSRA];
  *a &= ~(FE | DOR);
  if (usart->fifo_size == 0) {
    chip_clear_flag(uno, VECTOR_USART_RX, REG_UCSRA, RXC);
    return;
  }
  *a |= RXC | usart->fifo[0].flags;
  raise_levels(uno);
}

static void fifo_push(Usart *usart, uint8_t byte, uint8_t flags) {
  if (usart->overrun) flags |= DOR;
  usart->overrun = false;
  usart->fifo[usart->fifo_size].byte = byte;
  usart->fifo[usart->fifo_size++].flags = flags;
}

// The byte that the receiver reads if it was sent at another speed: sampled mid-bit at the receiver's own rate.
static uint8_t sample(const Uno *uno, const ByteAt *sent, uint8_t *flags) {
  uint32_t frame = 0x200u | (uint32_t)sent->byte << 1;  // start, 8 data, stop; idle is high
  double own = cycles_per_bit(uno);
  uint8_t byte = 0;
  for (int bit = 1; bit <= 9; bit++) {
    int line_bit = (int)((bit + 0.5) * own / sent->bit_cycles);
    int level = line_bit > 9 ? 1 : (frame >> line_bit) & 1;
    if (bit <= 8) byte |= level << (bit - 1);
    if (bit == 9) *flags = level ? 0 : FE;
  }
  return byte;
}

static void receive(Uno *uno, const ByteAt *arrived) {
  Usart *usart = &uno->usart;
  if (!(uno->avr->data[REG_UCSRB] & RXEN)) return;
  uint8_t flags;
  uint8_t byte = sample(uno, arrived, &flags);
  if (usart->fifo_size < 2) {
    fifo_push(usart, byte, flags);
  } else {
    if (usart->shift_full) {  // the waiting byte is overwritten and lost
      usart->overrun = true;
      usart->overruns++;
    }
    usart->shift_full = true;
    usart->shift_byte = byte;
    usart->shift_flags = flags;
  }
  show_head(uno);
}

static avr_cycle_count_t byte_arrives(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr;
  Uno *uno = param;
  ByteQueue *line = &uno->usart.line_in;
  ByteAt arrived;
  if (!queue_pop(line, &arrived)) return 0;
  receive(uno, &arrived);
  if (line->size == 0) return 0;
  uint64_t next = line->items[line->first].cycle;
  return next > when ? next : when + 1;
}

static avr_cycle_count_t byte_leaves(avr_t *avr, avr_cycle_count_t when, void *param) {
  Uno *uno = param;
  Usart *usart = &uno->usart;
  ByteAt sent = {when, usart->sending_byte, cycles_per_bit(uno)};
  queue_push(&usart->line_out, sent);
  events_add(uno, UNO_EVENT_UART_OUT, 0, usart->sending_byte);
  if (uno->stop_on_output) {
    uno->stop_now = true;
    uno->until_cycle = avr->cycle;
  }
  if (usart->buffered) {
    usart->buffered = false;
    usart->sending_byte = usart->buffered_byte;
    avr->data[REG_UCSRA] |= UDRE;
    raise_levels(uno);
    return when + cycles_per_frame(uno);
  }
  usart->sending = false;
  avr->data[REG_UCSRA] |= TXC;
  raise_levels(uno);
  return 0;
}

static uint8_t udr_read(avr_t *avr, avr_io_addr_t address, void *param) {
  (void)avr;
  (void)address;
  Uno *uno = param;
  Usart *usart = &uno->usart;
  if (usart->fifo_size == 0) return 0;
  uint8_t byte = usart->fifo[0].byte;
  usart->fifo[0] = usart->fifo[1];
  usart->fifo_size--;
  if (usart->shift_full) {
    usart->shift_full = false;
    fifo_push(usart, usart->shift_byte, usart->shift_flags);
  }
  show_head(uno);
  return byte;
}

static void udr_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  (void)address;
  Uno *uno = param;
  Usart *usart = &uno->usart;
  if (!(avr->data[REG_UCSRB] & TXEN)) return;
  if (!usart->sending) {
    usart->sending = true;
    usart->sending_byte = value;
    chip_at(uno, avr->cycle + cycles_per_frame(uno), byte_leaves);
  } else {
    usart->buffered = true;  // if written while UDRE was clear, the older byte is lost, as on the chip
    usart->buffered_byte = value;
    chip_clear_flag(uno, VECTOR_USART_UDRE, REG_UCSRA, UDRE);
  }
}

static void ucsra_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  Uno *uno = param;
  uint8_t flags = avr->data[address] & ~(U2X | 0x01);
  if (value & TXC) {
    flags &= ~TXC;
    uno->vector[VECTOR_USART_TX]->pending = 0;
  }
  avr->data[address] = flags | (value & (U2X | 0x01));
}

static void ucsrb_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  Uno *uno = param;
  avr->data[address] = value;
  if (!(value & RXEN)) {
    uno->usart.fifo_size = 0;
    uno->usart.shift_full = uno->usart.overrun = false;
    show_head(uno);
  }
  raise_levels(uno);
}

void usart_attach(Uno *uno) {
  chip_take_register(uno, REG_UDR, udr_read, udr_write);
  chip_take_register(uno, REG_UCSRA, NULL, ucsra_write);
  chip_take_register(uno, REG_UCSRB, NULL, ucsrb_write);
  chip_take_register(uno, REG_UCSRC, NULL, NULL);
  chip_take_register(uno, REG_UBRRL, NULL, NULL);
  chip_take_register(uno, REG_UBRRH, NULL, NULL);
  chip_on_return(uno, VECTOR_USART_RX, on_return);
  chip_on_return(uno, VECTOR_USART_UDRE, on_return);
}

void usart_after_reset(Uno *uno) {
  Usart *usart = &uno->usart;
  usart->fifo_size = 0;
  usart->shift_full = usart->overrun = usart->sending = usart->buffered = false;
  uno->avr->data[REG_UCSRA] = UDRE;
  uno->avr->data[REG_UCSRB] = 0;
  uno->avr->data[REG_UCSRC] = 0x06;
  if (usart->line_in.size > 0) {  // a reset does not affect the wire, but cancelled its timer
    chip_at(uno, usart->line_in.items[usart->line_in.first].cycle, byte_arrives);
  }
}

int uno_uart_send(Uno *uno, const uint8_t *bytes, int size, double baud) {
  Usart *usart = &uno->usart;
  if (!uno->powered) return 0;
  double bit_cycles = CLOCK_HZ / baud;
  uint64_t free_at = usart->line_in_free > uno->avr->cycle ? usart->line_in_free : uno->avr->cycle;
  bool idle = usart->line_in.size == 0;
  for (int i = 0; i < size; i++) {
    free_at += (uint64_t)(10 * bit_cycles + 0.5);
    queue_push(&usart->line_in, (ByteAt){free_at, bytes[i], bit_cycles});
  }
  usart->line_in_free = free_at;
  if (idle && size > 0) chip_at(uno, usart->line_in.items[usart->line_in.first].cycle, byte_arrives);
  return size;
}

int uno_uart_receive(Uno *uno, uint8_t *bytes, uint64_t *cycles, int capacity) {
  int count = 0;
  ByteAt item;
  while (count < capacity && queue_pop(&uno->usart.line_out, &item)) {
    bytes[count] = item.byte;
    cycles[count++] = item.cycle;
  }
  return count;
}

int uno_uart_pending(const Uno *uno) { return uno->usart.line_in.size; }
