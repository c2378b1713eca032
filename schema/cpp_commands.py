"""Generate lib/commands/command_table.{h,cpp}, lib/text/phrase_table.cpp and lib/link/message_table.{h,cpp}."""

from cpp_parameters import C_TYPE, NOTICE, constant, text_list
from frame import OPEN_SEED, frame
from tables import NAME_BYTES, CommandTable, Message


def words(name: str, entries: list[str], packed: dict[str, str] | None = None) -> str:
    """Return the C++ definition of a list of strings in flash; `packed` maps entries to their packed form."""
    return f"const char {name}[] BIFA_FLASH =\n{text_list(entries, packed or {})}"


def command_header(table: CommandTable) -> str:
    typed = [c for c in table.commands if c.usage]
    results = "\n".join(f"  {constant(name)}," for name, _ in table.results)
    ids = "\n".join(f"  {constant(c.name)}," for c in typed)
    cases = "\n".join(f"    case CommandId::{constant(c.name)}:\n      return console.{c.name}();" for c in typed)
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
extern const char kCommandTexts[] BIFA_FLASH;     ///< of each command: how it is typed, what it does
extern const char kResultTexts[] BIFA_FLASH;      ///< of each result: what went wrong
{lists}

/// How many words a line of each command has, itself included: the least in the upper half, the most in the lower.
extern const uint8_t kCommandWords[kCommandCount];

/// Calls what is called as the command: a console that lacks one does not compile.
template <typename Handler>
void dispatch(CommandId id, Handler& console) {{
  switch (id) {{
{cases}
  }}
}}

}}  // namespace bifa
"""


def phrase_source(phrases: list[str]) -> str:
    return f"""{NOTICE}#include "phrases.h"

namespace bifa {{

{words("kPhrases", phrases)}

}}  // namespace bifa
"""


def command_source(table: CommandTable, packed: dict[str, str]) -> str:
    typed = [c for c in table.commands if c.usage]
    lists = "\n".join(words(f"k{name}Words", entries) for name, entries in table.words.items())
    arities = "\n".join(f"    0x{least}{most},  // {c.usage}" for c in typed for least, most in [c.words()])
    return f"""{NOTICE}#include "command_table.h"

namespace bifa {{

{words("kCommandTexts", [entry for c in typed for entry in (c.usage, c.help)], packed)}
{words("kResultTexts", [entry for _, entry in table.results], packed)}
{lists}

const uint8_t kCommandWords[kCommandCount] BIFA_FLASH = {{
{arities}
}};

}}  // namespace bifa
"""


def stop_frame(table: CommandTable) -> bytes:
    """Return the stop message's frame, always the same bytes: it is of kind `open`, and its sequence number is 0."""
    number = next(c.message.number for c in table.commands if c.name == "stop_now")
    return frame(bytes([number, 0]), OPEN_SEED)


def _struct_name(message: Message) -> str:
    return "".join(part.capitalize() for part in message.name.split("_")) + "Message"


def _cases(messages: list[Message], rest: str, form: str) -> str:
    """Return the cases of a switch over messages. Each calls the member named after its message, with the message's
    fields and `rest`; `form` is the template of the statement around the call."""

    def call(message: Message) -> str:
        fields = [f"fields_as<{_struct_name(message)}>(fields)"] if message.fields else []
        return f"session.on_{message.name}({', '.join([*fields, *([rest] if rest else [])])})"

    return "\n".join(f"    case MessageId::{constant(m.name)}:\n{form.format(call(m))}" for m in messages)


def _struct(message: Message, set_size: int) -> str:
    types = {**C_TYPE, "name": "char", "set": "ParameterSet"}

    def declaration(field) -> str:
        count = NAME_BYTES if field.wire == "name" else field.count
        return f"  {types[field.wire]} {field.name}{f'[{count}]' if count > 1 else ''};"

    name = _struct_name(message)
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
    in_session = [m for m in inward if m.kind == "session"]
    asking = _cases([m for m in in_session if m.answer], "about...", "      {};\n      return true;")
    doing = _cases([m for m in in_session if not m.answer], "", "      return {};")
    longest_in = max(m.size(set_size) for m in inward)
    longest_out = max(m.size(set_size) for m in table.reports)
    version = ".".join(map(str, table.firmware_version))
    return f"""{NOTICE}#pragma once

#include "command_table.h"
#include "parameter_table.h"

namespace bifa {{

const uint8_t kFirmwareVersion[3] BIFA_FLASH = {{{", ".join(map(str, table.firmware_version))}}};
const uint8_t kProtocolVersion = {table.protocol_version};
/// Changes whenever anything changes that host and Uno must agree on.
const uint32_t kTableHash = 0x{table_hash:08X}UL;
/// The same three for people, as the host writes them.
#define BIFA_VERSIONS "{version}, protocol {table.protocol_version}, table {table_hash:08x}"

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
/// The fields of a message, from the bytes that travelled.
template <typename Fields>
Fields fields_as(const uint8_t* bytes) {{
  static_assert(sizeof(Fields) <= kLongestInward, "fields fit their frame");
  Fields fields;
  memcpy(&fields, bytes, sizeof fields);
  return fields;
}}

// Both call the member `on_` and the name of the message: a session that lacks one does not compile.

/// Messages that are answered by what they ask for; false if this is none. `about`: what the answers need to know.
template <typename Handler, typename... About>
bool answer(MessageId message, const uint8_t* fields, Handler& session, const About&... about) {{
  switch (message) {{
{asking}
    default:
      return false;
  }}
}}

/// Messages that do something; unknown if this is none.
template <typename Handler>
Result carry_out(MessageId message, const uint8_t* fields, Handler& session) {{
  switch (message) {{
{doing}
    default:
      return Result::kUnknown;
  }}
}}

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
