// SPDX-License-Identifier: GPL-3.0-or-later
// Declarations shared by the parts of the simulated board.
#ifndef VIRTUAL_ROBOT_BOARD_H
#define VIRTUAL_ROBOT_BOARD_H

#include <stdbool.h>
#include <stddef.h>

#include "avr_ioport.h"
#include "sim_avr.h"
#include "uno.h"

// ATmega328P registers (data-space addresses, datasheet section 30).
enum {
  REG_PINB = 0x23,
  REG_DDRB,
  REG_PORTB,
  REG_PINC,
  REG_DDRC,
  REG_PORTC,
  REG_PIND,
  REG_DDRD,
  REG_PORTD,
  REG_EECR = 0x3F,
  REG_EEDR = 0x40,
  REG_EEARL = 0x41,
  REG_EEARH = 0x42,
  REG_MCUSR = 0x54,
  REG_ADCL = 0x78,
  REG_ADCH = 0x79,
  REG_ADCSRA = 0x7A,
  REG_ADCSRB = 0x7B,
  REG_ADMUX = 0x7C,
  REG_TCCR1A = 0x80,
  REG_TCCR1C = 0x82,
  REG_TWBR = 0xB8,
  REG_TWSR = 0xB9,
  REG_TWDR = 0xBB,
  REG_TWCR = 0xBC,
  REG_UCSRA = 0xC0,
  REG_UCSRB = 0xC1,
  REG_UCSRC = 0xC2,
  REG_UBRRL = 0xC4,
  REG_UBRRH = 0xC5,
  REG_UDR = 0xC6
};

// Interrupt vectors (datasheet table 11-6, counted from 0).
enum {
  VECTOR_USART_RX = 18,
  VECTOR_USART_UDRE = 19,
  VECTOR_USART_TX = 20,
  VECTOR_ADC = 21,
  VECTOR_EE_READY = 22,
  VECTOR_TWI = 24,
  VECTOR_COUNT = 26
};

#define CLOCK_HZ 16000000u
#define PORT_COUNT 3  // B, C, D

typedef struct ByteAt {
  uint64_t cycle;
  uint8_t byte;
  double bit_cycles;
} ByteAt;

typedef struct ByteQueue {
  ByteAt *items;
  int first, size, capacity;
} ByteQueue;

typedef struct WrappedWrite {  // libsimavr's own handler behind ours
  avr_io_write_t write;
  void *param;
} WrappedWrite;

typedef struct Compare {
  WrappedWrite behind;
  bool level;  // OC1B, whether or not it drives the pin
} Compare;

typedef struct Usart {
  ByteQueue line_in;   // on the wire towards the Uno, stamped with the end of the stop bit
  ByteQueue line_out;  // complete bytes from the Uno
  uint64_t line_in_free;
  struct {
    uint8_t byte, flags;
  } fifo[2];
  int fifo_size;
  bool shift_full;
  uint8_t shift_byte, shift_flags;
  bool overrun;
  bool sending, buffered;
  uint8_t sending_byte, buffered_byte;
  uint64_t overruns;
} Usart;

typedef struct Adc {
  uint8_t mux;  // latched when the conversion starts
  bool converting, first, locked;
  uint64_t start_cycle;
  uint16_t sampled;
  double volts[8];
} Adc;

typedef struct Twi {
  int mode;
  bool owned, expects_address, reading;
  uint8_t status, next_status, next_data;
  bool addressed;  // the MCP4725 is listening
  int byte_index;
  uint8_t command, first_byte;
  int dac_code;
  uint64_t dac_eeprom_writes;
  bool stop_pending, start_after_stop;
  bool held;
} Twi;

typedef struct Eeprom {
  uint8_t *bytes;
  int size;
  bool writing;
  uint64_t start_cycle, done_cycle;
  uint16_t address;
  uint8_t old_value, new_value;
  int cut_after;
  double cut_fraction;
  uint64_t cut_cycle;
  uint64_t writes;
} Eeprom;

struct Uno {
  avr_t *avr;
  avr_io_t after_reset;  // last in libsimavr's list: corrects what its reset leaves wrong
  UnoWorld world;
  avr_int_vector_t *vector[VECTOR_COUNT];
  uint64_t until_cycle;
  uint64_t held_until;
  uint64_t asleep_cycles;
  bool powered, crashed, stop_on_output, stop_now;
  uint8_t mcusr;
  bool optiboot;
  bool hung;
  uint16_t hung_instruction;  // the instruction that the hang replaces
  uint32_t hung_at;
  uint32_t resets;
  int reset_cause, last_reset_cause;
  WrappedWrite port_write[PORT_COUNT * 3];
  uint8_t driven[PORT_COUNT], direction[PORT_COUNT], wired[PORT_COUNT], input[PORT_COUNT];
  Compare compare;
  Usart usart;
  Adc adc;
  Twi twi;
  Eeprom eeprom;
  UnoEvent *events;
  int event_count, event_capacity;
  int64_t events_dropped;
  bool keep_events;
  uint64_t event_hash;
};

// events.c
void events_add(Uno *uno, int kind, int index, int value);
void queue_push(ByteQueue *queue, ByteAt item);
bool queue_pop(ByteQueue *queue, ByteAt *item);

// chip.c
void chip_at(Uno *uno, uint64_t cycle, avr_cycle_timer_t callback);
void chip_clear_flag(Uno *uno, int vector, uint8_t reg, uint8_t mask);
void chip_on_return(Uno *uno, int vector, avr_irq_notify_t notify);
void chip_take_register(Uno *uno, uint8_t reg, avr_io_read_t read, avr_io_write_t write);

void usart_attach(Uno *uno);
void usart_after_reset(Uno *uno);
void adc_attach(Uno *uno);
void adc_after_reset(Uno *uno);
void twi_attach(Uno *uno);
void twi_after_reset(Uno *uno);
void eeprom_attach(Uno *uno);
void eeprom_after_reset(Uno *uno);
void pins_attach(Uno *uno);
void pins_release(Uno *uno);
void pins_after_reset(Uno *uno);
void pins_update_port_b(Uno *uno);
void compare_attach(Uno *uno);
void compare_after_reset(Uno *uno);
uint8_t compare_overrides(const Uno *uno, uint8_t latch);

#endif
