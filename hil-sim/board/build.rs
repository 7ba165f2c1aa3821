//! Makes constants of the vendor's description of the chip; `src/description.rs` includes them.

use std::collections::BTreeMap;
use std::path::Path;
use std::{env, fs};

/// The description, see `data/stm32g474.py`.
const TABLE: &str = "data/stm32g474.csv";

fn main() {
    println!("cargo::rerun-if-changed={TABLE}");
    let table = fs::read_to_string(TABLE).expect("the description");
    let (mut code, mut names, mut interrupts) = (String::new(), Vec::new(), String::new());
    // Offsets and fields of each block, and its registers.
    let mut blocks: BTreeMap<&str, (String, String)> = BTreeMap::new();
    for line in table.lines() {
        match line.split(',').collect::<Vec<_>>()[..] {
            ["peripheral", name, block, address] => {
                names.push((address, name));
                code += &format!(
                    "pub const {name}: Peripheral = Peripheral {{ name: {name:?}, \
                     address: {address}, registers: {block}::REGISTERS }};\n"
                );
            }
            ["register", block, name, offset, reset, fields] => {
                let (constants, registers) = blocks.entry(block).or_default();
                let module = name.to_lowercase();
                *constants += &format!("pub const {name}: u32 = {offset};\n");
                *constants += &format!("pub mod {module} {{\n{}}}\n", fields_of(offset, fields));
                *registers +=
                    &format!("Register::new({name:?}, {offset}, {reset}, {module}::FIELDS),\n");
            }
            ["interrupt", name, number] => interrupts += &format!("({name:?}, {number}),\n"),
            _ => {}
        }
    }
    for (block, (constants, registers)) in blocks {
        code += &format!("/// Offsets of registers, and their fields.\npub mod {block} {{\n");
        code += &format!("use super::Register;\n{constants}");
        code += &format!("pub const REGISTERS: &[Register] = &[\n{registers}];\n}}\n");
    }
    names.sort_unstable();
    let names: Vec<&str> = names.into_iter().map(|(_, name)| name).collect();
    code += &format!(
        "/// In the order of addresses.\npub const PERIPHERALS: &[Peripheral] = &[{}];\n",
        names.join(", ")
    );
    code += &format!("const INTERRUPTS: &[(&str, u8)] = &[\n{interrupts}];\n");
    let out = env::var_os("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&out).join("description.rs"), code).expect("written");
}

/// Constants of the fields of the register at an offset.
fn fields_of(offset: &str, fields: &str) -> String {
    let (mut code, mut names) = ("use super::super::Field;\n".to_owned(), Vec::new());
    for field in fields.split_whitespace() {
        let parts: Vec<&str> = field.split(':').collect();
        let [name, lowest, bits, access] = parts[..] else { panic!("a field: {field}") };
        names.push(name);
        code += &format!(
            "pub const {name}: Field = Field::new({name:?}, {offset}, {lowest}, {bits}, '{access}');\n"
        );
    }
    code + &format!("pub const FIELDS: &[Field] = &[{}];\n", names.join(", "))
}
