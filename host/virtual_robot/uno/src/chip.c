// SPDX-License-Identifier: GPL-3.0-or-later
// The ATmega328P core of libsimavr in virtual time: run loop, sleep, interrupt entry, resets and power.
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "avr_extint.h"
#include "board.h"
#include "sim_core.h"
#include "sim_elf.h"
#include "sim_hex.h"

#define INTERRUPT_ENTRY_CYCLES 4  // datasheet 7.7.1; libsimavr charges none
#define WAKE_UP_CYCLES 4          // added when waking from sleep
#define RAM_START 0x100
#define RAM_END 0x8FF
#define RAM_PAINT 0xA5

static void quiet_logger(avr_t *avr, const int level, const char *format, va_list arguments) {
  (void)avr;
  (void)level;
  (void)format;
  (void)arguments;
}

// libsimavr hands callbacks only an avr_t, so the board is found through its user data.
static Uno *board_of(avr_t *avr) { return avr->custom.data; }

static uint64_t cycles_left(const Uno *uno) {
  return uno->until_cycle > uno->avr->cycle ? uno->until_cycle - uno->avr->cycle : 0;
}

// Replaces avr_callback_run_raw: sleeps in virtual time, stops at the end of the slice, counts the cycles of interrupt
// entry.
static void run_slice(avr_t *avr) {
  Uno *uno = board_of(avr);
  avr_flashaddr_t next_pc = avr->pc;
  bool slept = false;
  if (avr->state == cpu_Running) {
    uint64_t left = cycles_left(uno);
    if (avr->run_cycle_count > left) avr->run_cycle_count = left ? left : 1;
    next_pc = avr_run_one(avr);
  }
  avr_cycle_count_t sleep = avr_cycle_timer_process(avr);
  avr->pc = next_pc;
  if (avr->state == cpu_Sleeping) {
    uint64_t left = cycles_left(uno);
    if (sleep > left) sleep = left;
    if (sleep == 0) sleep = 1;
    avr->cycle += sleep;
    uno->asleep_cycles += sleep;
    slept = true;
    avr_cycle_timer_process(avr);
  }
  if ((avr->state == cpu_Running || avr->state == cpu_Sleeping) && avr->interrupt_state) {
    int running = avr->interrupts.running_ptr;
    avr_service_interrupts(avr);
    if (avr->interrupts.running_ptr > running) {
      avr->cycle += INTERRUPT_ENTRY_CYCLES + (slept ? WAKE_UP_CYCLES : 0);
    }
  }
}

static void never_sleep(avr_t *avr, avr_cycle_count_t how_long) {
  (void)avr;
  (void)how_long;
}

// Sets the state in which Optiboot 4.4, the stock bootloader of Unos, leaves the chip after a reset, according to its
// listing. It clears MCUSR. After an external reset it waits for a program, with constants in r8 to r11 and an address
// in r12 and r13, then ends by a watchdog reset, which leaves these registers alone. After any other reset (its own
// included) it switches the watchdog off, two calls deep, and jumps to the program. uno_hold() models the wait.
static void bootloader(Uno *uno, int cause) {
  static const uint8_t waiting[] = {1, 0x11, 5, 3};           // r8 to r11
  static const uint8_t returns[] = {0x3F, 0xF7, 0x3F, 0x05};  // on the stack, to its end
  avr_t *avr = uno->avr;
  uno->mcusr = avr->data[REG_MCUSR] = 0;
  if (cause == UNO_RESET_EXTERNAL) memcpy(avr->data + 8, waiting, sizeof waiting);
  memcpy(avr->data + RAM_END + 1 - sizeof returns, returns, sizeof returns);
  avr->data[24] = avr->data[30] = avr->data[31] = 0;
  avr->data[25] = 0x18;
}

static void put_instruction(avr_t *avr, uint32_t address, uint16_t instruction) {
  avr->flash[address] = instruction & 0xFF;
  avr->flash[address + 1] = instruction >> 8;
}

void uno_hang(Uno *uno, int interrupts) {
  avr_t *avr = uno->avr;
  if (!uno->hung) {
    uno->hung_at = avr->pc;
    uno->hung_instruction = avr->flash[avr->pc] | avr->flash[avr->pc + 1] << 8;
  }
  uno->hung = true;
  put_instruction(avr, uno->hung_at, 0xCFFF);  // rjmp .-2
  avr->sreg[S_I] = interrupts;
  if (avr->state == cpu_Sleeping) avr->state = cpu_Running;
}

// libsimavr calls this last in every reset, including those by the watchdog.
static void after_reset(avr_io_t *io) {
  avr_t *avr = io->avr;
  Uno *uno = board_of(avr);
  if (uno == NULL) return;  // the reset inside avr_init
  avr->run_cycle_limit = 1000000;
  avr_extint_set_strict_lvl_trig(avr, 0, 0);
  avr_extint_set_strict_lvl_trig(avr, 1, 0);
  int cause = uno->reset_cause;
  if (cause < 0) cause = UNO_RESET_WATCHDOG;  // the only reset that uno_reset() does not start
  // MCUSR collects causes until the firmware or a power-on clears them.
  static const uint8_t flag[] = {0x01, 0x02, 0x04, 0x08};
  uno->mcusr = cause == UNO_RESET_POWER_ON ? flag[cause] : uno->mcusr | flag[cause];
  avr->data[REG_MCUSR] = uno->mcusr;
  uno->reset_cause = -1;
  uno->last_reset_cause = cause;
  uno->resets++;
  if (uno->hung) put_instruction(avr, uno->hung_at, uno->hung_instruction);
  uno->hung = false;
  if (uno->optiboot) bootloader(uno, cause);
  events_add(uno, UNO_EVENT_RESET, cause, 0);
  compare_after_reset(uno);
  pins_after_reset(uno);
  usart_after_reset(uno);
  adc_after_reset(uno);
  twi_after_reset(uno);
  eeprom_after_reset(uno);
}

static void mcusr_write(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  Uno *uno = param;
  uno->mcusr &= value;  // flags are only ever cleared by software
  avr->data[address] = uno->mcusr;
}

void chip_at(Uno *uno, uint64_t cycle, avr_cycle_timer_t callback) {
  uint64_t now = uno->avr->cycle;
  avr_cycle_timer_register(uno->avr, cycle > now ? cycle - now : 0, callback, uno);
}

void chip_clear_flag(Uno *uno, int vector, uint8_t reg, uint8_t mask) {
  uno->avr->data[reg] &= ~mask;
  uno->vector[vector]->pending = 0;
}

void chip_on_return(Uno *uno, int vector, avr_irq_notify_t notify) {
  avr_irq_register_notify(&uno->vector[vector]->irq[AVR_INT_IRQ_RUNNING], notify, uno);
}

// Takes a register away from libsimavr's own peripheral model.
void chip_take_register(Uno *uno, uint8_t reg, avr_io_read_t read, avr_io_write_t write) {
  avr_io_addr_t io = AVR_DATA_TO_IO(reg);
  uno->avr->io[io].r.c = read;
  uno->avr->io[io].r.param = read ? uno : NULL;
  uno->avr->io[io].w.c = write;
  uno->avr->io[io].w.param = write ? uno : NULL;
}

static void paint_ram(Uno *uno) { memset(uno->avr->data + RAM_START, RAM_PAINT, RAM_END + 1 - RAM_START); }

static void append_io(avr_t *avr, avr_io_t *io) {
  avr_io_t **tail = &avr->io_port;
  while (*tail) tail = &(*tail)->next;
  *tail = io;
  io->avr = avr;
  io->next = NULL;
}

static bool ends_in(const char *text, const char *end) {
  size_t length = strlen(text), of_end = strlen(end);
  return length >= of_end && strcmp(text + length - of_end, end) == 0;
}

static bool read_image(const char *path, elf_firmware_t *firmware) {
  memset(firmware, 0, sizeof *firmware);
  if (!ends_in(path, ".hex")) return elf_read_firmware(path, firmware) == 0 && firmware->flashsize > 0;
  firmware->flash = read_ihex_file(path, &firmware->flashsize, &firmware->flashbase);
  return firmware->flash != NULL && firmware->flashsize > 0;
}

Uno *uno_new(const char *path, char *error, int error_size) {
  avr_global_logger_set(quiet_logger);
  elf_firmware_t firmware;
  if (!read_image(path, &firmware)) {
    snprintf(error, error_size, "%s is not an AVR image, ELF or HEX", path);
    return NULL;
  }
  avr_t *avr = avr_make_mcu_by_name("atmega328p");
  if (avr == NULL || firmware.flashbase + firmware.flashsize > 0x8000) {
    snprintf(error, error_size, "%s does not fit an ATmega328P", path);
    return NULL;
  }
  Uno *uno = calloc(1, sizeof *uno);
  uno->avr = avr;
  uno->event_hash = 0xCBF29CE484222325ull;
  avr_init(avr);
  avr_load_firmware(avr, &firmware);
  avr->frequency = CLOCK_HZ;
  avr->custom.data = uno;
  avr->run = run_slice;
  avr->sleep = never_sleep;
  for (int i = 0; i < avr->interrupts.vector_count; i++) {
    avr_int_vector_t *vector = avr->interrupts.vector[i];
    if (vector->vector < VECTOR_COUNT) uno->vector[vector->vector] = vector;
  }
  uno->after_reset.kind = "board";
  uno->after_reset.reset = after_reset;
  append_io(avr, &uno->after_reset);
  chip_take_register(uno, REG_MCUSR, NULL, mcusr_write);
  pins_attach(uno);
  compare_attach(uno);
  usart_attach(uno);
  adc_attach(uno);
  twi_attach(uno);
  eeprom_attach(uno);
  free(firmware.flash);
  free(firmware.eeprom);
  for (uint32_t i = 0; i < firmware.symbolcount; i++) free(firmware.symbol[i]);
  free(firmware.symbol);
  uno_reset(uno, UNO_RESET_POWER_ON);
  return uno;
}

void uno_free(Uno *uno) {
  avr_t *avr = uno->avr;
  avr_io_t **link = &avr->io_port;  // ours is part of Uno: libsimavr must not deallocate it
  while (*link && *link != &uno->after_reset) link = &(*link)->next;
  if (*link) *link = uno->after_reset.next;
  avr->custom.data = NULL;
  avr_terminate(avr);
  free(avr);
  free(uno->events);
  free(uno->usart.line_in.items);
  free(uno->usart.line_out.items);
  free(uno);
}

void uno_connect(Uno *uno, const UnoWorld *world) { uno->world = *world; }

int uno_run(Uno *uno, uint64_t until_cycle, int stop_on_output) {
  avr_t *avr = uno->avr;
  uno->until_cycle = until_cycle;
  uno->stop_on_output = stop_on_output;
  uno->stop_now = stop_on_output && uno->usart.line_out.size > 0;
  if (uno->powered && avr->cycle < uno->held_until) {
    avr->cycle = uno->held_until < until_cycle ? uno->held_until : until_cycle;
    avr_cycle_timer_process(avr);  // bytes that arrive now find the receiver off
  }
  while (uno->powered && !uno->crashed && !uno->stop_now && avr->cycle < until_cycle) {
    int state = avr_run(avr);
    if (state == cpu_Crashed || state == cpu_Done || state == cpu_Stopped) {
      uno->crashed = true;
      pins_release(uno);
    }
  }
  if (uno->stop_now) return UNO_OUTPUT_READY;
  if (avr->cycle < until_cycle) avr->cycle = until_cycle;  // time passes for a dead chip too
  if (!uno->powered) return UNO_POWERED_OFF;
  return uno->crashed ? UNO_CRASHED : UNO_RUNNING;
}

void uno_reset(Uno *uno, int cause) {
  uno->reset_cause = cause;
  if (cause == UNO_RESET_POWER_ON) {
    paint_ram(uno);
    uno->powered = true;
    uno->eeprom.writing = false;
    uno->twi.dac_code = 0;  // the MCP4725's own EEPROM holds 0
    if (uno->world.dac_changed) uno->world.dac_changed(uno->world.context, uno->avr->cycle, 0);
  }
  if (!uno->powered) return;  // a button without power does nothing
  uno->crashed = false;
  avr_reset(uno->avr);
}

void uno_use_optiboot(Uno *uno, int use) { uno->optiboot = use; }

void uno_hold(Uno *uno, uint64_t cycles) { uno->held_until = uno->avr->cycle + cycles; }

void uno_power_off(Uno *uno) {
  uno->powered = false;
  pins_release(uno);
  ByteAt lost;
  while (queue_pop(&uno->usart.line_in, &lost)) continue;
}

void uno_status(const Uno *uno, UnoStatus *status) {
  memset(status, 0, sizeof *status);
  status->cycle = uno->avr->cycle;
  status->asleep_cycles = uno->asleep_cycles;
  status->event_hash = uno->event_hash;
  status->rx_overruns = uno->usart.overruns;
  status->dac_eeprom_writes = uno->twi.dac_eeprom_writes;
  status->eeprom_writes = uno->eeprom.writes;
  status->resets = uno->resets;
  status->last_reset_cause = uno->last_reset_cause;
  status->dac_code = uno->twi.dac_code;
  status->powered = uno->powered;
  status->crashed = uno->crashed;
}

static int clip(int size, int room) { return size < room ? size : (room > 0 ? room : 0); }

void uno_peek_ram(const Uno *uno, uint16_t address, uint8_t *bytes, int size) {
  memcpy(bytes, uno->avr->data + address, clip(size, RAM_END + 1 - address));
}

void uno_poke_ram(Uno *uno, uint16_t address, const uint8_t *bytes, int size) {
  memcpy(uno->avr->data + address, bytes, clip(size, RAM_END + 1 - address));
}

uint32_t uno_program_counter(const Uno *uno) { return uno->avr->pc; }

int uno_untouched_ram(const Uno *uno, uint16_t from) {
  int count = 0;
  for (int address = from; address <= RAM_END && uno->avr->data[address] == RAM_PAINT; address++) count++;
  return count;
}
