"""Writes lib/commands/command_table.{h,cpp} and lib/link/message_table.{h,cpp}."""

from cpp_parameters import C_TYPE, NOTICE, constant, text
from frame import OPEN_SEED, frame
from tables import NAME_BYTES, CommandTable, Message


def words(name: str, entries: list[str]) -> str:
    """The definition of a list of texts in flash, each ended by a zero."""
    return f"const char {name}[] BIFA_FLASH =\n" + "\n".join(f'    {text(entry)[:-1]}\\0"' for entry in entries) + ";"


def command_header(table: CommandTable) -> str:
    typed = [c for c in table.commands if c.usage]
    results = "\n".join(f"  {constant(name)}," for name, _ in table.results)
    ids = "\n".join(f"  {constant(c.name)}," for c in typed)
    lists = "\n".join(f"extern const char k{name}Words[] BIFA_FLASH;" for name in table.words)
    return f"""{NOTICE}#pragma once

#include <stdint.h>

#include "flash.h"

namespace bifa {{

/// How a command ended; the same on the console and in frames.
enum class Result : uint8_t {{
{results}
}};

/// The commands that people type.
enum class CommandId : uint8_t {{
{ids}
}};
const uint8_t kCommandCount = {len(typed)};

// Lists of texts, one after the other, each ended by a zero; read them with flash_text().
extern const char kCommandTexts[] BIFA_FLASH;  ///< of each command: how it is typed, what it does
extern const char kResultTexts[] BIFA_FLASH;   ///< of each result: what went wrong
{lists}

}}  // namespace bifa
"""


def command_source(table: CommandTable) -> str:
    typed = [c for c in table.commands if c.usage]
    lists = "\n".join(words(f"k{name}Words", entries) for name, entries in table.words.items())
    return f"""{NOTICE}#include "command_table.h"

namespace bifa {{

{words("kCommandTexts", [entry for c in typed for entry in (c.usage, c.help)])}
{words("kResultTexts", [entry for _, entry in table.results])}
{lists}

}}  // namespace bifa
"""


def stop_frame(table: CommandTable) -> bytes:
    """The only bytes that the stop message ever has: it is open, and its sequence number is 0."""
    number = next(c.message.number for c in table.commands if c.name == "stop_now")
    return frame(bytes([number, 0]), OPEN_SEED)


def _struct(message: Message, set_size: int) -> str:
    types = {**C_TYPE, "name": "char", "set": "ParameterSet"}

    def declaration(field) -> str:
        count = NAME_BYTES if field.wire == "name" else field.count
        return f"  {types[field.wire]} {field.name}{f'[{count}]' if count > 1 else ''};"

    name = "".join(part.capitalize() for part in message.name.split("_")) + "Message"
    fields = "\n".join(declaration(f) for f in message.fields)
    return f"""/// {message.help}.
struct {name} {{
{fields}
}} __attribute__((packed));
static_assert(sizeof({name}) == {message.size(set_size)}, "no holes");
"""


def message_header(table: CommandTable, set_size: int, table_hash: int) -> str:
    inward = [c.message for c in table.commands if c.message]
    everything = inward + list(table.reports)
    numbers = "\n".join(f"  {constant(m.name)} = 0x{m.number:02X}," for m in everything)
    structs = "\n".join(_struct(m, set_size) for m in everything if m.fields)
    stop = stop_frame(table)
    longest_in = max(m.size(set_size) for m in inward)
    longest_out = max(m.size(set_size) for m in table.reports)
    return f"""{NOTICE}#pragma once

#include <stdint.h>

#include "parameter_table.h"

namespace bifa {{

const uint8_t kProtocolVersion = {table.protocol_version};
/// Changes whenever anything changes that host and Uno must agree on.
const uint32_t kTableHash = 0x{table_hash:08X}UL;

enum class MessageId : uint8_t {{
{numbers}
}};

const uint8_t kLongestInward = {longest_in};   ///< bytes of the fields of the longest message to the Uno
const uint8_t kLongestOutward = {longest_out};  ///< and of the longest from it
const uint8_t kNameBytes = {NAME_BYTES};

/// The real-time stop between its delimiters; the same in every version, and always the same bytes.
const uint8_t kStopFrameBytes = {len(stop)};
extern const uint8_t kStopFrame[kStopFrameBytes];

/// Exact size of the fields of a message to the Uno; false if there is no such message.
bool inward_size(uint8_t message, uint8_t& size);

{structs}
}}  // namespace bifa
"""


def message_source(table: CommandTable, set_size: int) -> str:
    inward = [c.message for c in table.commands if c.message]
    rows = "\n".join(f"    {{0x{m.number:02X}, {m.size(set_size)}}},  // {m.name}" for m in inward)
    return f"""{NOTICE}#include "message_table.h"

namespace bifa {{

namespace {{
struct Inward {{
  uint8_t message;
  uint8_t size;
}};
const Inward kInward[] BIFA_FLASH = {{
{rows}
}};
}}  // namespace

const uint8_t kStopFrame[kStopFrameBytes] BIFA_FLASH = {{{", ".join(f"0x{b:02X}" for b in stop_frame(table))}}};

bool inward_size(uint8_t message, uint8_t& size) {{
  for (const Inward& row : kInward) {{
    if (flash_byte(&row.message) != message) continue;
    size = flash_byte(&row.size);
    return true;
  }}
  return false;
}}

}}  // namespace bifa
"""
