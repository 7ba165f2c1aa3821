//! A real probe, by probe-rs.

use std::path::Path;
use std::time::Duration;

use probe_rs::flashing::{DownloadOptions, ElfLoader, ElfOptions, download_file_with_options};
use probe_rs::probe::list::Lister;
use probe_rs::probe::{DebugProbeInfo, DebugProbeSelector};
use probe_rs::rtt::{Error as RttError, Rtt, ScanRegion};
use probe_rs::{Core, MemoryInterface, Permissions, Session};

use super::{Port, PortError};
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
pub struct RealPort {
    session: Session,
    rtt: Option<Rtt>,
    /// Address of the control block; unknown, it is searched for in RAM.
    block: Option<u32>,
}

impl RealPort {
    /// Attaches to the board at the only probe, or at the one that `PROBE_RS_PROBE`
    /// names, without disturbing what runs there. The control block of its channels is
    /// at `block`, if that is known.
    pub fn attach(block: Option<u32>) -> Result<Self, PortError> {
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
        Ok(Self { session, rtt: None, block })
    }

    /// Puts an image into the board's flash and reads it back. Parameters stored there stay.
    pub fn flash(&mut self, elf: &Path) -> Result<(), PortError> {
        self.rtt = None;
        let mut options = DownloadOptions::default();
        options.verify = true;
        let loader = ElfLoader(ElfOptions::default());
        download_file_with_options(&mut self.session, elf, loader, options)
            .map_err(|error| PortError::Board(format!("flashing failed: {}", with_causes(&error))))
    }

    /// Acts on core and channels, which are searched for first; returns `otherwise` if there
    /// are none yet.
    fn with<T>(
        &mut self,
        otherwise: T,
        act: impl FnOnce(&mut Core<'_>, &mut Rtt) -> Result<T, PortError>,
    ) -> Result<T, PortError> {
        let mut core = self.session.core(0).map_err(gone)?;
        if self.rtt.is_none() {
            let found = match self.block {
                Some(block) => Rtt::attach_at(&mut core, block.into()),
                None => Rtt::attach_region(&mut core, &ScanRegion::Ram),
            };
            match found {
                Ok(rtt) => self.rtt = Some(rtt),
                // Not set up yet, or half set up.
                Err(RttError::ControlBlockNotFound | RttError::ControlBlockCorrupted(_)) => {
                    return Ok(otherwise);
                }
                Err(error) => return Err(gone(error)),
            }
        }
        match &mut self.rtt {
            Some(rtt) => act(&mut core, rtt),
            None => Ok(otherwise),
        }
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
        self.with(Vec::new(), |core, rtt| {
            let up = rtt.up_channel(channel as usize).ok_or_else(|| missing(channel))?;
            let mut bytes = vec![0; up.buffer_size()];
            let read = match up.read(core, &mut bytes) {
                Ok(read) => read,
                // The firmware has just restarted.
                Err(RttError::ReadPointerChanged | RttError::ControlBlockCorrupted(_)) => 0,
                Err(error) => return Err(gone(error)),
            };
            bytes.truncate(read);
            Ok(bytes)
        })
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.with(0, |core, rtt| {
            let down = rtt.down_channel(channel as usize).ok_or_else(|| missing(channel))?;
            match down.write(core, bytes) {
                Ok(sent) => Ok(sent),
                Err(RttError::ControlBlockCorrupted(_)) => Ok(0),
                Err(error) => Err(gone(error)),
            }
        })
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.rtt = None;
        let mut core = self.session.core(0).map_err(gone)?;
        core.reset_and_halt(HALT).map_err(gone)?;
        if let Some(block) = self.block {
            // The rings may hold data of the run before.
            core.write_8(block.into(), &[0; MARK]).map_err(gone)?;
        }
        core.run().map_err(gone)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        let mut core = self.session.core(0).map_err(gone)?;
        core.read(address.into(), into).map_err(gone)
    }

    fn pass(&mut self) -> Result<Duration, PortError> {
        std::thread::sleep(PAUSE);
        Ok(PAUSE)
    }
}
