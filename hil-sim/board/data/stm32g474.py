"""Registers of the STM32G474 as ST describes them, one a line: writes `stm32g474.csv`.

    python3 hil-sim/board/data/stm32g474.py > hil-sim/board/data/stm32g474.csv

The source is the crate `stm32g4`, which svd2rust made of ST's description (SVD, with the
corrections of the project stm32-rs). Cargo fetches it; the script reads the crate's text, so
nothing is compiled. A test of the long sample compares its output with the file.

Lines:
    peripheral,NAME,block,address
    register,block,NAME,offset,value after reset,fields
    interrupt,NAME,number

A field is `NAME:lowest bit:bits:access`. The access is `r` (read only), `w` (written by itself),
`s` (1 sets or starts), `c` (1 clears), `z` (0 clears). Several descriptions of one offset
(compare and capture) are several lines.
"""

import json
import pathlib
import re
import subprocess
import tempfile

CRATE, VERSION, CHIP = "stm32g4", "0.16.0", "stm32g474"
# Peripherals that the firmware uses.
USED = (
    "TIM1 TIM2 TIM5 TIM7 TIM8 IWDG PWR SYSCFG EXTI SPI1 DMA1 DMAMUX RCC FLASH DBGMCU "
    "GPIOA GPIOB GPIOC GPIOD GPIOE GPIOF GPIOG ADC1 ADC2 ADC3 ADC4 ADC12_COMMON ADC345_COMMON"
).split()

ACCESSOR = re.compile(
    r"///(0x[0-9a-f]+)(?:\.\.(0x[0-9a-f]+))? - [^\n]*\n(?:\s*///[^\n]*\n)*"
    r"\s*#\[inline\(always\)\]\s*pub const fn (\w+)\(&self(, n: usize)?\) -> &(\w+)"
)
FIELD = re.compile(
    r"///Bits? (\d+)(?::(\d+))?(?: - [^\n]*)?\n(?:\s*///[^\n]*\n)*"
    r"\s*#\[inline\(always\)\]\s*pub fn (\w+)\(&(mut )?self\) -> (\w+)"
)
WRITER = re.compile(r"pub type (\w+_W)<[^=]*= *crate::(\w+)<")
ALIAS = re.compile(r"pub use (?:[\w:]+::)?(\w+_W)(?: as (\w+_W))?;")
ACCESS = {"BitWriter1S": "s", "BitWriter1C": "c", "BitWriter0C": "z"}


def source():
    """The folder of the chip in the crate's source, fetched by cargo."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "src").mkdir()
        (folder / "src/lib.rs").touch()
        (folder / "Cargo.toml").write_text(
            '[package]\nname = "fetch"\nversion = "0.0.0"\nedition = "2021"\n'
            f'[dependencies]\n{CRATE} = {{ version = "={VERSION}", default-features = false }}\n'
            "[workspace]\n"
        )
        command = ["cargo", "metadata", "--format-version", "1", "--manifest-path"]
        done = subprocess.run(
            [*command, str(folder / "Cargo.toml")], check=True, stdout=subprocess.PIPE
        )
    packages = json.loads(done.stdout)["packages"]
    manifest = next(p["manifest_path"] for p in packages if p["name"] == CRATE)
    return pathlib.Path(manifest).parent / "src" / CHIP


def number(text):
    return int(text.replace("_", ""), 0)


def fields(text):
    """The fields of a register's module."""
    writers = {name: ACCESS.get(kind, "w") for name, kind in WRITER.findall(text)}
    # Writers of an equal field, also of another block's: those are plain ones.
    for of, name in ALIAS.findall(text):
        writers[name or of] = writers.get(of, "w")
    found = {}
    for low, high, name, mutable, kind in FIELD.findall(text):
        low, high = int(low), int(high or low)
        access = writers[kind] if mutable else "r"
        old = found.get(name.upper())
        if old is None or old[2] == "r":
            found[name.upper()] = (low, high - low + 1, access)
    ordered = sorted(found.items(), key=lambda field: (field[1], field[0]))
    return " ".join(f"{name}:{low}:{bits}:{access}" for name, (low, bits, access) in ordered)


def accessors(text):
    """Offset, name and type of a block's registers; those of an array one by one."""
    found = ACCESSOR.findall(text)
    single = {at for at, _, _, array, _ in found if not array}
    for at, end, name, array, kind in found:
        if not array:
            yield number(at), name, kind
        elif at not in single:
            for index, place in enumerate(range(number(at), number(end), 4)):
                yield place, f"{name}{index}", kind


def registers(folder, block, offset=0, prefix=""):
    """Name, offset, value after reset and fields of a block's registers, clusters included."""
    text = (folder / f"{block}.rs").read_text()
    for at, name, kind in accessors(text):
        at, home, declared = offset + at, block, text
        if alias := re.search(rf"pub use (\w+) as {kind};", text):
            kind = alias[1]
        if shared := re.search(rf"pub use crate::{CHIP}::(\w+)::{kind};", text):
            home = shared[1]
            declared = (folder / f"{home}.rs").read_text()
        register = re.search(rf"pub type {kind} = crate::Reg<(\w+)::", declared)
        if register is None:
            yield from registers(folder / block, kind.lower(), at, f"{prefix}{name.upper()}_")
            continue
        module = (folder / home / f"{register[1]}.rs").read_text()
        reset = re.search(r"RESET_VALUE: u(?:8|16|32) = (\w+);", module)
        yield f"{prefix}{name.upper()}", at, number(reset[1]) if reset else 0, fields(module)


def main():
    folder = source()
    text = (folder / "mod.rs").read_text()
    periphs = re.findall(r"pub type (\w+) = crate::Periph<(\w+)::RegisterBlock, (0x[\w]+)>;", text)
    places = {name: (block, number(address)) for name, block, address in periphs}
    print(f"# {CRATE} {VERSION} ({CHIP}), MIT OR Apache-2.0, made of ST's SVD: see stm32g474.py")
    for name in USED:
        block, address = places[name]
        print(f"peripheral,{name},{block},{address:#010x}")
    for block in sorted({places[name][0] for name in USED}):
        for name, offset, reset, known in sorted(registers(folder, block), key=lambda r: r[1]):
            print(f"register,{block},{name},{offset:#05x},{reset:#010x},{known}")
    enumeration = text[text.index("pub enum Interrupt") :]
    enumeration = enumeration[: enumeration.index("\n}")]
    for name, line in re.findall(r"^    (\w+) = (\d+),", enumeration, re.MULTILINE):
        print(f"interrupt,{name},{line}")


if __name__ == "__main__":
    main()
