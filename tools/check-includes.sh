#!/bin/sh
# The controller in lib/ knows neither Arduino nor the chip's registers. (avr-libc's constants in flash and its
# CRC instructions are plain functions, and welcome.)
set -eu
cd "$(dirname "$0")/.."
foreign='^[[:space:]]*#[[:space:]]*include[[:space:]]*[<"](Arduino|Wire|SPI|EEPROM|Print|Stream|HardwareSerial|Adafruit_|avr/|util/)'
welcome='(avr/pgmspace|util/crc16)\.h'
if grep -rnE "$foreign" lib | grep -vE "$welcome"; then
    echo "error: lib/ must not include the headers above; go through an interface that firmware/ implements" >&2
    exit 1
fi
