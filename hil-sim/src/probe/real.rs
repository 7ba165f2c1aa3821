//! A real probe, by probe-rs.

use std::path::Path;
use std::time::{Duration, Instant};

use probe_rs::flashing::{DownloadOptions, ElfLoader, ElfOptions, download_file_with_options};
use probe_rs::probe::list::Lister;
use probe_rs::probe::{DebugProbeInfo, DebugProbeSelector};
use probe_rs::rtt::{self, Error as RttError, ScanRegion};
use probe_rs::{Core, MemoryInterface, Permissions, Session};

use super::{Access, ChannelError, Channels, Port, PortError, Rtt};
use crate::files::with_causes;

const CHIP: &str = "STM32G474RETx";
/// Which probe, if there are several: as for probe-rs' own tools.
const SELECTOR: &str = "PROBE_RS_PROBE";
/// Longest wait for the core to stop.
const HALT: Duration = Duration::from_millis(500);
/// Pause between two polls: less than a transfer over USB takes.
const PAUSE: Duration = Duration::from_micros(200);
/// Bytes of the mark at the beginning of the control block.
const MARK: usize = 16;

/// A board at a probe.
pub(crate) struct RealPort {
    session: Session,
    channels: Channels<rtt::Rtt>,
    /// Address of the control block; unknown, it is searched for in RAM.
    block: Option<u32>,
    opened: Instant,
}

impl RealPort {
    /// Attaches to the board at the only probe, or at the one that `PROBE_RS_PROBE`
    /// names, without disturbing what runs there. The control block of its channels is
    /// at `block`, if that is known.
    pub(crate) fn attach(block: Option<u32>) -> Result<Self, PortError> {
        let absent = |error: &dyn std::fmt::Display| PortError::Absent(error.to_string());
        let lister = Lister::new();
        let probe = match std::env::var(SELECTOR) {
            Ok(text) => {
                let selector: DebugProbeSelector =
                    text.parse().map_err(|error| absent(&format!("{SELECTOR}={text}: {error}")))?;
                lister
                    .open(selector)
                    .map_err(|error| PortError::Absent(format!("{SELECTOR}={text}: {error}")))?
            }
            Err(_) => {
                only(&lister.list_all())?.open().map_err(|error| absent(&with_causes(&error)))?
            }
        };
        let session = probe
            .attach(CHIP, Permissions::default())
            .map_err(|error| PortError::Gone(with_causes(&error)))?;
        Ok(Self { session, channels: Channels::default(), block, opened: Instant::now() })
    }

    /// Puts an image into the board's flash and reads it back. Parameters stored there stay.
    pub(crate) fn flash(&mut self, elf: &Path) -> Result<(), PortError> {
        self.channels.forget();
        let mut options = DownloadOptions::default();
        options.verify = true;
        let loader = ElfLoader(ElfOptions::default());
        download_file_with_options(&mut self.session, elf, loader, options)
            .map_err(|error| PortError::Board(format!("flashing failed: {}", with_causes(&error))))
    }

    const fn parts(&mut self) -> (&mut Channels<rtt::Rtt>, Link<'_>) {
        (&mut self.channels, Link { session: &mut self.session, block: self.block })
    }
}

struct Link<'a> {
    session: &'a mut Session,
    block: Option<u32>,
}

impl Link<'_> {
    fn core(&mut self) -> Result<Core<'_>, PortError> {
        self.session.core(0).map_err(gone)
    }
}

/// Of the errors of an access these are the board's.
fn stale(error: RttError) -> ChannelError<PortError> {
    match error {
        RttError::ReadPointerChanged
        | RttError::ControlBlockNotFound
        | RttError::ControlBlockCorrupted(_) => ChannelError::Stale,
        error => ChannelError::Failed(gone(error)),
    }
}

impl Rtt for Link<'_> {
    type Handle = rtt::Rtt;
    type Error = PortError;

    fn attach(&mut self) -> Result<Option<rtt::Rtt>, PortError> {
        let block = self.block;
        let mut core = self.core()?;
        let found = match block {
            Some(block) => rtt::Rtt::attach_at(&mut core, block.into()),
            None => rtt::Rtt::attach_region(&mut core, &ScanRegion::Ram),
        };
        match found.map_err(stale) {
            Ok(rtt) => Ok(Some(rtt)),
            // Not set up yet, or half set up.
            Err(ChannelError::Stale) => Ok(None),
            Err(ChannelError::Failed(error)) => Err(error),
        }
    }

    fn read(&mut self, rtt: &mut rtt::Rtt, channel: u32) -> Access<Vec<u8>, PortError> {
        let up = rtt.up_channel(channel as usize).ok_or_else(|| missing(channel))?;
        let mut bytes = vec![0; up.buffer_size()];
        let read = up.read(&mut self.core()?, &mut bytes).map_err(stale)?;
        bytes.truncate(read);
        Ok(bytes)
    }

    fn write(
        &mut self,
        rtt: &mut rtt::Rtt,
        heard: Option<u32>,
        channel: u32,
        bytes: &[u8],
    ) -> Access<usize, PortError> {
        let mut core = self.core()?;
        if let Some(up) = heard.and_then(|heard| rtt.up_channel(heard as usize)) {
            // Reads the offsets alone.
            up.peek(&mut core, &mut []).map_err(stale)?;
        }
        let down = rtt.down_channel(channel as usize).ok_or_else(|| missing(channel))?;
        down.write(&mut core, bytes).map_err(stale)
    }
}

fn only(probes: &[DebugProbeInfo]) -> Result<&DebugProbeInfo, PortError> {
    match probes {
        [one] => Ok(one),
        [] => Err(PortError::Absent(
            "no debug probe is attached: connect the board's ST-LINK by USB (on Linux the \
             user needs access to it, see probe.rs/docs)"
                .to_owned(),
        )),
        several => {
            let names: Vec<String> = several.iter().map(ToString::to_string).collect();
            Err(PortError::Absent(format!(
                "{} debug probes are attached, {SELECTOR}=VID:PID:SERIAL says which: {}",
                several.len(),
                names.join("; ")
            )))
        }
    }
}

fn gone(error: impl std::error::Error + 'static) -> PortError {
    PortError::Gone(with_causes(&error))
}

fn missing(channel: u32) -> PortError {
    PortError::Board(format!("the firmware on the board has no RTT channel {channel}"))
}

impl Port for RealPort {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        let (channels, mut link) = self.parts();
        channels.up(&mut link, channel)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        let (channels, mut link) = self.parts();
        channels.down(&mut link, channel, bytes)
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.channels.forget();
        let mut core = self.session.core(0).map_err(gone)?;
        core.reset_and_halt(HALT).map_err(gone)?;
        if let Some(block) = self.block {
            // The rings may hold data of the run before.
            core.write_8(block.into(), &[0; MARK]).map_err(gone)?;
        }
        core.run().map_err(gone)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.parts().1.core()?.read(address.into(), into).map_err(gone)
    }

    fn pass(&mut self) -> Result<(), PortError> {
        std::thread::sleep(PAUSE);
        Ok(())
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }
}
