//! The account on the terminal and as JSON.

use serde::Serialize;

use super::super::failure::{Failure, Outcome};
use super::super::output;
use super::Args;
use crate::account::{Account, Phase, PhaseCost, Share, Spread};
use crate::image::Image;
use crate::model::Measured;
use hil_sim::table::{number, plain};

/// Most functions listed on the terminal.
const LISTED: usize = 15;

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    account: &'a Account,
    model: &'a [Measured],
    firmware_flash_bytes: u64,
    busiest: Option<Phase>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    profiles: Vec<Profile>,
}

/// Functions of one phase.
#[derive(Serialize)]
struct Profile {
    phase: Phase,
    functions: Vec<Share>,
}

/// What was found out.
pub(super) struct Found<'a> {
    pub(super) account: &'a Account,
    pub(super) model: &'a [Measured],
    pub(super) image: &'a Image,
    /// Flash that the firmware takes, bytes.
    pub(super) flash: u64,
}

pub(super) fn show(args: &Args, found: &Found<'_>) -> Result<Outcome, Failure> {
    let Found { account, model, image, flash } = *found;
    let mut profiles = Vec::new();
    if args.profile_functions {
        for cost in account.busiest().into_iter().chain(account.smooth()) {
            let functions = account.profile(image, &cost.phase).map_err(Failure::run)?;
            profiles.push(Profile { phase: cost.phase, functions });
        }
    }
    let printed = Printed {
        account,
        model,
        firmware_flash_bytes: flash,
        busiest: account.busiest().map(|cost| cost.phase),
        profiles,
    };
    output::result(args.json, &printed, || text(&printed))?;
    Ok(Outcome::Good)
}

fn text(printed: &Printed<'_>) -> String {
    let account = printed.account;
    let whole = [("control tick", &account.tick), ("plan", &account.plan)];
    let phases =
        account.phases.iter().map(|PhaseCost { phase, tick }| row(phase.to_string(), tick));
    let model = printed.model.iter().map(|m| row(m.function.to_owned(), &m.cost));
    let rows = phases.chain(whole.map(|(name, spread)| row(name.to_owned(), spread))).chain(model);
    let head = ["phase", "calls", "least", "mean", "most", "instructions", "dearest"];
    let mut text = format!("{}\n", plain(&head, rows));
    text += &format!(
        "{} ticks with the same output on host and core; firmware {} bytes of flash\n",
        account.ticks, printed.firmware_flash_bytes
    );
    for profile in &printed.profiles {
        let rows = profile.functions.iter().take(LISTED).map(|share| {
            vec![share.function.clone(), number(share.cycles, 1), number(share.share * 100.0, 1)]
        });
        text += &format!("\n{}\n{}\n", profile.phase, plain(&["function", "cycles", "%"], rows));
    }
    text
}

fn row(name: String, spread: &Spread) -> Vec<String> {
    vec![
        name,
        spread.calls.to_string(),
        spread.least.to_string(),
        number(spread.mean(), 1),
        spread.most.to_string(),
        number(spread.instructions as f64 / spread.calls.max(1) as f64, 1),
        spread.dearest.to_string(),
    ]
}
