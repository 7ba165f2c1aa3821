//! The board at a real debug probe.

#[cfg(not(feature = "probe"))]
pub(super) use absent::{attach, go_on, reconnecting};
#[cfg(feature = "probe")]
pub(super) use attached::{attach, reconnecting};

#[cfg(feature = "probe")]
mod attached {
    use std::time::Duration;

    use crate::cli::failure::Failure;
    use crate::probe::{PortError, RealPort, ReconnectingPort};

    /// Time between two attempts to find a probe again.
    const PAUSE: Duration = Duration::from_millis(500);
    /// Longest time without it.
    const PATIENCE: Duration = Duration::from_secs(120);

    /// Attaches to the board, whose channels' control block lies at `block` if that is known.
    pub(in crate::cli) fn attach(target: &str, block: Option<u32>) -> Result<RealPort, Failure> {
        is_probe(target)?;
        RealPort::attach(block).map_err(missing)
    }

    /// The same, connected again whenever the probe was unplugged.
    pub(in crate::cli) fn reconnecting(target: &str) -> Result<ReconnectingPort<'static>, Failure> {
        is_probe(target)?;
        ReconnectingPort::open(|| Ok(Box::new(RealPort::attach(None)?)), PAUSE, PATIENCE)
            .map_err(missing)
    }

    fn is_probe(target: &str) -> Result<(), Failure> {
        if target == "probe" { Ok(()) } else { Err(Failure::of_target(target)) }
    }

    /// A probe that is missing at the start is bad input.
    fn missing(error: PortError) -> Failure {
        Failure::input(format!("--target probe: {error}"))
    }
}

#[cfg(not(feature = "probe"))]
mod absent {
    use std::fs;
    use std::path::Path;

    use crate::cli::failure::{Failure, Outcome};
    use crate::probe::ReconnectingPort;
    use crate::provision::{self, Extra};

    /// What Linux lists of USB.
    const USB: &str = "/sys/bus/usb/devices";
    /// What the names of probes for this chip have in them, in lower case.
    const NAMES: [&str; 4] = ["stlink", "st-link", "cmsis-dap", "j-link"];

    /// Other binaries have probe-rs and the emulated board.
    pub(in crate::cli) fn attach(
        target: &str,
        _: Option<u32>,
    ) -> Result<ReconnectingPort<'static>, Failure> {
        Err(Failure::of_target(target))
    }

    /// See [`attach`].
    pub(in crate::cli) fn reconnecting(target: &str) -> Result<ReconnectingPort<'static>, Failure> {
        attach(target, None)
    }

    /// Starts the binary with probe-rs. Where Linux lists no probe, nothing is built for one.
    pub(in crate::cli) fn go_on() -> Result<Outcome, Failure> {
        let named = std::env::var("PROBE_RS_PROBE").ok();
        if cfg!(target_os = "linux") && !is_attached(USB.as_ref(), named.as_deref()) {
            let which = named.map_or_else(String::new, |named| format!(" PROBE_RS_PROBE={named}"));
            return Err(Failure::input(format!(
                "--target probe: no debug probe{which} is attached: connect the board's ST-LINK by USB"
            )));
        }
        Ok(Outcome::Code(provision::go_on(Extra::Probe)?))
    }

    /// Whether a probe is among the devices of this folder: the one of this VID:PID, or any.
    fn is_attached(usb: &Path, named: Option<&str>) -> bool {
        let devices = fs::read_dir(usb).into_iter().flatten().flatten();
        devices.map(|device| device.path()).any(|device| {
            let of = |file: &str| fs::read_to_string(device.join(file)).unwrap_or_default();
            let id = format!("{}:{}", of("idVendor").trim(), of("idProduct").trim());
            let product = of("product").to_lowercase();
            match named {
                Some(named) => named.to_lowercase().starts_with(&id) && id.len() > 1,
                None => NAMES.iter().any(|name| product.contains(name)),
            }
        })
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn a_probe_is_found_by_its_name_or_its_number() {
            let usb = tempfile::tempdir().unwrap();
            let put = |place: &str, vendor: &str, product: &str, name: &str| {
                let folder = usb.path().join(place);
                fs::create_dir(&folder).unwrap();
                for (file, text) in
                    [("idVendor", vendor), ("idProduct", product), ("product", name)]
                {
                    fs::write(folder.join(file), format!("{text}\n")).unwrap();
                }
            };
            put("1-1", "046d", "c31c", "USB Keyboard");
            fs::create_dir(usb.path().join("1-1:1.0")).unwrap();
            let is = |named| is_attached(usb.path(), named);
            assert!(!is(None) && is(Some("046D:C31C:1234")) && !is(Some("dead:beef")));
            put("1-2", "0483", "374e", "STLINK-V3");
            assert!(is(None) && is(Some("0483:374e")));
            assert!(!is_attached(&usb.path().join("none"), None));
        }
    }
}
