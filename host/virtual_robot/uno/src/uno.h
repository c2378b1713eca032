// SPDX-License-Identifier: GPL-3.0-or-later
// Public interface of the simulated Uno. Time is counted in CPU cycles at 16 MHz and passes only in uno_run().
#ifndef VIRTUAL_ROBOT_UNO_H
#define VIRTUAL_ROBOT_UNO_H

#include <stdint.h>

typedef struct Uno Uno;

// Callbacks into the world outside the board. Any may be NULL.
typedef struct UnoWorld {
  void *context;
  void (*pin_changed)(void *context, uint64_t cycle, int pin, int level);  // a driven Arduino pin
  double (*analog_volts)(void *context, uint64_t cycle, int channel);      // A0..A5 at this instant
  void (*dac_changed)(void *context, uint64_t cycle, int code);            // MCP4725 output, 0..4095
} UnoWorld;

typedef struct UnoEvent {
  uint64_t cycle;
  int32_t kind;   // one of UNO_EVENT_*
  int32_t index;  // pin, EEPROM address, reset cause
  int32_t value;
} UnoEvent;

enum { UNO_EVENT_PIN = 1, UNO_EVENT_UART_OUT, UNO_EVENT_DAC, UNO_EVENT_EEPROM, UNO_EVENT_RESET };
enum { UNO_RESET_POWER_ON = 0, UNO_RESET_EXTERNAL, UNO_RESET_BROWN_OUT, UNO_RESET_WATCHDOG };
// Stuck: nothing is answered. Held: bytes are acknowledged, but the bus is held so that no transfer can end.
enum { UNO_DAC_PRESENT = 0, UNO_DAC_ABSENT, UNO_BUS_STUCK, UNO_BUS_HELD };
enum { UNO_RUNNING = 0, UNO_OUTPUT_READY, UNO_POWERED_OFF, UNO_CRASHED };

typedef struct UnoStatus {
  uint64_t cycle;
  uint64_t asleep_cycles;
  uint64_t event_hash;
  uint64_t rx_overruns;
  uint64_t dac_eeprom_writes;
  uint64_t eeprom_writes;
  uint32_t resets;
  int32_t last_reset_cause;
  int32_t dac_code;
  int32_t powered;
  int32_t crashed;
} UnoStatus;

Uno *uno_new(const char *path, char *error, int error_size);
void uno_free(Uno *uno);
void uno_connect(Uno *uno, const UnoWorld *world);

// Runs until `until_cycle` (exactly when asleep, else to the end of the instruction that reaches it).
// With `stop_on_output` it returns UNO_OUTPUT_READY as soon as a sent byte is complete.
int uno_run(Uno *uno, uint64_t until_cycle, int stop_on_output);
void uno_status(const Uno *uno, UnoStatus *status);

void uno_reset(Uno *uno, int cause);
// Executes nothing for this long, while everything around the processor keeps running, as during a bootloader's wait
// after an external reset. Bytes sent meanwhile are lost: the receiver is off.
void uno_hold(Uno *uno, uint64_t cycles);
void uno_power_off(Uno *uno);
// From the next reset on, behaves like a Uno with its stock bootloader (Optiboot 4.4): see bootloader() in chip.c.
void uno_use_optiboot(Uno *uno, int use);
// Makes the program loop forever at its next instruction, with interrupts on or off, until a reset.
void uno_hang(Uno *uno, int interrupts);

int uno_uart_send(Uno *uno, const uint8_t *bytes, int size, double baud);
int uno_uart_receive(Uno *uno, uint8_t *bytes, uint64_t *cycles, int capacity);
int uno_uart_pending(const Uno *uno);  // bytes sent to the Uno that have not fully arrived yet

int uno_pin(const Uno *uno, int pin);  // level of a driven pin, -1 = not driven
void uno_set_input(Uno *uno, int pin, int level);
void uno_set_analog(Uno *uno, int channel, double volts);  // used if the world has no analog_volts
void uno_set_bus(Uno *uno, int mode);

void uno_eeprom_read(const Uno *uno, uint8_t *bytes, int size);
void uno_eeprom_load(Uno *uno, const uint8_t *bytes, int size);
// The power fails while the n-th byte from now is being written (n >= 1), `fraction` of 3.4 ms into it.
void uno_eeprom_cut_power(Uno *uno, int n, double fraction);

void uno_peek_ram(const Uno *uno, uint16_t address, uint8_t *bytes, int size);
void uno_poke_ram(Uno *uno, uint16_t address, const uint8_t *bytes, int size);
uint32_t uno_program_counter(const Uno *uno);
// Number of bytes from `from` upwards, without a gap, that the firmware has not written since power-on (RAM starts
// painted).
int uno_untouched_ram(const Uno *uno, uint16_t from);

// Events are numbered from 0 since uno_keep_events(); the log keeps at least the last half million.
// Returns how many were copied from number `first` on, -1 if that event has been dropped.
int uno_events(const Uno *uno, UnoEvent *events, int64_t first, int capacity);
int64_t uno_event_count(const Uno *uno);  // including dropped ones
void uno_keep_events(Uno *uno, int keep);

#endif
