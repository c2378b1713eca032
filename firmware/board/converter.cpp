#include "converter.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "tick.h"
#include "wires.h"

namespace board {

namespace {

const uint8_t kMonitorChannel = 3;
const uint8_t kReferenceAvcc = 1 << REFS0;
const uint8_t kStart = 1 << ADEN | 1 << ADSC | 1 << ADIE | 1 << ADPS2 | 1 << ADPS1 | 1 << ADPS0;  // 125 kHz

// Channels are converted forwards and backwards (0 1 2 2 1 0 ...), so that the means of the three sensors refer to the
// same instant; then the monitor.
const uint8_t kConversions = bifa::kChamberCount * bifa::kOversampling;
bifa::RawRound round;
uint8_t conversion;
uint8_t channel;
int8_t direction;
volatile bool round_ends = false;

void convert(uint8_t input) {
  ADMUX = kReferenceAvcc | input;
  ADCSRA = kStart;
}

}  // namespace

void converter_begin() {
  DIDR0 = 0x0F;  // A0 to A3 are analog
  ADCSRA = kStart & ~(1 << ADSC);
}

void converter_begin_round() {
  for (uint8_t i = 0; i < bifa::kChamberCount; ++i) round.sum[i] = 0;
  conversion = 0;
  channel = 0;
  direction = 1;
  convert(channel);
}

void converter_tick() {
  if (!round_ends) return;
  round_ends = false;
  on_round(round);
}

}  // namespace board

ISR(ADC_vect) {
  using namespace board;
  const uint16_t result = ADC;
  if (conversion == kConversions) {
    round.monitor = result;
    strobe_end();
    round_ends = true;
    return;
  }
  const uint8_t converted = channel;
  ++conversion;
  const uint8_t next = channel + direction;
  if (next < bifa::kChamberCount) {  // also false for "-1"
    channel = next;
  } else {
    direction = -direction;  // the same channel once more, on the way back
  }
  convert(conversion == kConversions ? kMonitorChannel : channel);
  round.sum[converted] += result;
}
