// SPDX-License-Identifier: GPL-3.0-or-later
// Everything that leaves the board, with its cycle: a log for tests and a running hash for determinism.
// An event keeps its number even after older ones have been dropped.
#include <stdlib.h>
#include <string.h>

#include "board.h"

#define EVENT_LIMIT (1 << 20)  // about 24 MB; older events are dropped by half

static uint64_t fnv1a(uint64_t hash, const void *data, size_t size) {
  const uint8_t *bytes = data;
  for (size_t i = 0; i < size; i++) hash = (hash ^ bytes[i]) * 0x100000001B3ull;
  return hash;
}

void events_add(Uno *uno, int kind, int index, int value) {
  UnoEvent event = {uno->avr->cycle, kind, index, value};
  uno->event_hash = fnv1a(uno->event_hash, &event.cycle, sizeof event.cycle);
  uno->event_hash = fnv1a(uno->event_hash, &event.kind, 3 * sizeof event.kind);
  if (!uno->keep_events) return;
  if (uno->event_count == EVENT_LIMIT) {
    memmove(uno->events, uno->events + EVENT_LIMIT / 2, EVENT_LIMIT / 2 * sizeof *uno->events);
    uno->event_count = EVENT_LIMIT / 2;
    uno->events_dropped += EVENT_LIMIT / 2;
  }
  if (uno->event_count == uno->event_capacity) {
    uno->event_capacity = uno->event_capacity ? 2 * uno->event_capacity : 1024;
    uno->events = realloc(uno->events, uno->event_capacity * sizeof *uno->events);
  }
  uno->events[uno->event_count++] = event;
}

int64_t uno_event_count(const Uno *uno) { return uno->events_dropped + uno->event_count; }

int uno_events(const Uno *uno, UnoEvent *events, int64_t first, int capacity) {
  if (first < uno->events_dropped) return -1;
  int64_t count = uno_event_count(uno) - first;
  if (count > capacity) count = capacity;
  if (count <= 0) return 0;
  memcpy(events, uno->events + (first - uno->events_dropped), count * sizeof *events);
  return count;
}

void uno_keep_events(Uno *uno, int keep) {
  uno->keep_events = keep;
  uno->event_count = 0;
  uno->events_dropped = 0;
}

void queue_push(ByteQueue *queue, ByteAt item) {
  if (queue->first + queue->size == queue->capacity) {
    if (queue->first > 0) memmove(queue->items, queue->items + queue->first, queue->size * sizeof item);
    queue->first = 0;
    if (queue->size == queue->capacity) {
      queue->capacity = queue->capacity ? 2 * queue->capacity : 256;
      queue->items = realloc(queue->items, queue->capacity * sizeof item);
    }
  }
  queue->items[queue->first + queue->size++] = item;
}

bool queue_pop(ByteQueue *queue, ByteAt *item) {
  if (queue->size == 0) return false;
  *item = queue->items[queue->first++];
  if (--queue->size == 0) queue->first = 0;
  return true;
}
