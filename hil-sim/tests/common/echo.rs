//! Readback of healthy bridges, for a controller that runs without a plant.

use interstage::sense::raw::{BridgeCode, BridgeCodes};
use interstage::supervise::Lag;
use interstage::tick::Output;
use interstage::units::MotorCommand;

/// Two bridges that follow their command, without noise.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Echo([Lag; 2]);

impl Echo {
    /// Their readback a tick after this output.
    pub(crate) fn read(&mut self, output: &Output) -> BridgeCodes {
        let [drive, pretightener] = &mut self.0;
        let code = |lag: &mut Lag, command: MotorCommand| {
            let duty = if command.enable { command.duty.to_bits() } else { 0 };
            BridgeCode::of(lag.step(duty.into()))
        };
        BridgeCodes {
            drive: code(drive, output.drive),
            pretightener: code(pretightener, output.preload),
        }
    }
}
