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

// There and back again, so that the means of the three sensors belong to the same instant. Then the monitor.
const uint8_t kConversions = bifa::kChamberCount * bifa::kOversampling;
const uint8_t kThereAndBack[] = {0, 1, 2, 2, 1, 0};

bifa::RawRound round;
uint8_t conversion;
uint8_t place;  // in kThereAndBack

void convert(uint8_t channel) {
  ADMUX = kReferenceAvcc | channel;
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
  place = 0;
  convert(kThereAndBack[0]);
}

}  // namespace board

ISR(ADC_vect) {
  using namespace board;
  const uint16_t result = ADC;
  if (conversion == kConversions) {
    round.monitor = result;
    strobe_end();
    on_round(round);
    return;
  }
  const uint8_t channel = kThereAndBack[place];
  ++conversion;
  place = place + 1 == sizeof kThereAndBack ? 0 : place + 1;
  convert(conversion == kConversions ? kMonitorChannel : kThereAndBack[place]);
  round.sum[channel] += result;
}
