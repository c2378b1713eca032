#include "uart.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include "output.h"
#include "wires.h"

namespace board {

namespace {

const uint32_t kBaud = 250000;
const uint8_t kRingBytes = 92;
const uint8_t kRest = 1 << RXEN0 | 1 << TXEN0 | 1 << RXCIE0;
const uint8_t kSending = kRest | 1 << UDRIE0;

uint8_t ring[kRingBytes];
volatile uint8_t head;  // where the next byte is written
volatile uint8_t tail;  // where the next byte is read

uint8_t after(uint8_t place) { return place + 1 == kRingBytes ? 0 : place + 1; }

}  // namespace

void uart_begin() {
  UBRR0 = F_CPU / 8 / kBaud - 1;
  UCSR0A = 1 << U2X0;
  UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;  // 8N1
  UCSR0B = kRest;
}

}  // namespace board

void bifa::output(uint8_t byte) {
  using namespace board;
  const uint8_t place = head;
  const uint8_t next = after(place);
  while (next == tail) sleep_cpu();
  ring[place] = byte;
  head = next;
  UCSR0B = kSending;
}

uint8_t bifa::output_room() {
  using namespace board;
  const uint8_t out = tail;
  return out > head ? out - head - 1 : kRingBytes + out - head - 1;
}

ISR(USART_RX_vect) {
  const uint8_t errors = UCSR0A & (1 << DOR0 | 1 << FE0);  // of the byte that is read next
  board::on_byte(UDR0, errors != 0);
}

ISR(USART_UDRE_vect) {
  using namespace board;
  const uint8_t place = tail;
  if (head == place) {
    UCSR0B = kRest;
    return;
  }
  UDR0 = ring[place];
  tail = after(place);
}
