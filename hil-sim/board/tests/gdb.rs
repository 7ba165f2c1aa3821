//! A debugger on the emulated board, over TCP.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::Duration;

use hil_sim::firmware::{self, Profile};
use hil_sim::scenario::Scenario;
use rig_board::elf::Loaded;
use rig_board::gdb;

/// A client of the remote protocol.
struct Client(TcpStream);

impl Client {
    /// Sends a packet and returns what is answered.
    fn ask(&mut self, packet: &str) -> String {
        self.send(packet);
        self.answer()
    }

    fn send(&mut self, packet: &str) {
        let sum = packet.bytes().fold(0_u8, u8::wrapping_add);
        write!(self.0, "${packet}#{sum:02x}").expect("sent");
    }

    fn byte(&mut self) -> u8 {
        let mut byte = [0];
        self.0.read_exact(&mut byte).expect("an answer");
        byte[0]
    }

    /// The next packet, acknowledged.
    fn answer(&mut self) -> String {
        while self.byte() != b'$' {}
        let mut packet = Vec::new();
        loop {
            match self.byte() {
                b'#' => break,
                // A run of the character before.
                b'*' => {
                    let count = usize::from(self.byte() - 29);
                    let last = *packet.last().expect("a character");
                    packet.extend(std::iter::repeat_n(last, count));
                }
                byte => packet.push(byte),
            }
        }
        let _ = (self.byte(), self.byte());
        self.0.write_all(b"+").expect("sent");
        String::from_utf8(packet).expect("text")
    }

    /// The registers.
    fn registers(&mut self) -> Vec<u32> {
        let text = self.ask("g");
        let bytes: Vec<u8> = (0..text.len() / 2)
            .map(|byte| u8::from_str_radix(&text[2 * byte..2 * byte + 2], 16).expect("hex"))
            .collect();
        bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
    }
}

const PC: usize = 15;

#[test]
fn a_debugger_reads_stops_at_a_function_steps_and_goes_on() {
    let path = firmware::build(Profile::Release).expect("the firmware builds");
    let elf = std::fs::read(path).expect("readable");
    let loaded = Loaded::of(&elf).expect("an image");
    let place = |name: &str| {
        let found = loaded.functions.iter().find(|f| f.name.ends_with(name));
        found.unwrap_or_else(|| panic!("no {name}")).range.start
    };
    let (handler, reset) = (place("TIM2"), place("Reset"));
    let listener = gdb::listen(":0").expect("a port");
    let address = listener.local_addr().expect("bound");
    let image = elf.clone();
    let server = thread::spawn(move || {
        let scenario = Scenario::resolve(Some("prototype"), None, &[]).expect("a scenario");
        gdb::serve(&listener, &image, &scenario, |_, _| {}).map_err(|error| error.to_string())
    });
    let mut client = Client(TcpStream::connect(address).expect("connects"));
    client.0.set_read_timeout(Some(Duration::from_secs(60))).expect("set");
    assert!(client.ask("?").starts_with(['S', 'T']));
    assert_eq!(client.registers()[PC], reset, "before the first instruction");

    // The first interrupt of the time driver.
    assert_eq!(client.ask(&format!("Z0,{handler:x},2")), "OK");
    let stop = client.ask("c");
    assert!(stop.starts_with("T05") && stop.contains("swbreak"), "{stop}");
    let registers = client.registers();
    assert_eq!((registers[PC], registers[16] & 0x1FF), (handler, 16 + 28), "in the handler");

    // The debugger reads the program's code, not the breakpoint.
    let at = (handler - 0x0800_0000) as usize;
    let code = &loaded.flash[at..at + 4];
    let text: String = code.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(client.ask(&format!("m{handler:x},4")), text);
    assert!(client.ask("m40000000,4").starts_with('E'), "no side effects by looking");

    // One instruction on, then to the same place again, a later time.
    client.ask("s");
    let next = client.registers()[PC];
    assert!((2..=4).contains(&(next - handler)), "{next:#x}");
    let stop = client.ask("c");
    assert!(stop.contains("swbreak"), "{stop}");
    assert_eq!(client.registers()[PC], handler);

    // Memory that is written is read back.
    let free = 0x2001_0000;
    assert_eq!(client.ask(&format!("M{free:x},4:01020304")), "OK");
    assert_eq!(client.ask(&format!("m{free:x},4")), "01020304");

    // Without the breakpoint it runs until it is interrupted.
    assert_eq!(client.ask(&format!("z0,{handler:x},2")), "OK");
    client.send("c");
    thread::sleep(Duration::from_millis(200));
    client.0.write_all(&[3]).expect("sent");
    assert!(client.answer().starts_with(['S', 'T']));
    client.ask("D");
    assert_eq!(server.join().expect("ends"), Ok(()));
}
