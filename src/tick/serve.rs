//! The service mode in the tick.

use super::{Controller, Event, Pass, State};
use crate::sense::SensedState;
use crate::supervise::service::ServiceView;
use crate::supervise::{Mode, ServiceDuties, Trigger};
use crate::units::{Duty, MotorCommand};

/// What the bounds of the service mode look at.
pub(super) const fn view(sensed: &SensedState) -> ServiceView {
    ServiceView {
        travel: sensed.travel,
        preload: sensed.preload_filtered,
        compression: sensed.compression_filtered,
    }
}

impl Controller {
    /// Takes a request of the host. Asking for rest enters the mode from idle; in any other mode
    /// it is logged and changes nothing.
    pub(super) fn take_service(
        &self,
        state: &mut State,
        tick: &mut Pass<'_>,
        request: Option<ServiceDuties>,
    ) {
        let Some(request) = request else { return };
        if state.service.ask(request) {
            tick.log(Event::Service(request));
        }
        if state.mode == Mode::Idle && request.is_rest() {
            tick.trigger(Trigger::Service);
        }
    }

    /// Commands of drive and pre-tightener in the service mode.
    pub(super) fn serve(
        &self,
        state: &mut State,
        tick: &mut Pass<'_>,
    ) -> (MotorCommand, MotorCommand) {
        let (duties, limit) = state.service.step(&view(tick.sensed));
        if let Some(limit) = limit {
            tick.log(Event::Limit(limit));
        }
        // A bridge without a duty stays off, unless it brakes.
        let command = |duty, brakes| MotorCommand { duty, enable: brakes || duty != Duty::ZERO };
        (command(duties.drive, state.service.brakes()), command(duties.pretightener, false))
    }
}
