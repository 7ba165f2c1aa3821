//! Generates the constants of the reduced model from crossings of the ring.
//!
//! The crossings, some minutes of work, are kept in `data/crossings.csv`, from which the
//! constants follow in a second. Whether the file is still what the ring gives shows on
//! a sample of its rows.

pub mod data;
pub mod design;
pub mod fit;

use std::fmt::Write as _;

use anyhow::{Context, Result, ensure};
use interstage::model::effective_stiffness::Kind;
use interstage::model::formula::Formula;
use interstage::rig::Rig;
use interstage::units::Direction;

use data::Row;
use design::{DesignPoint, Use};

/// All crossings of the file, in its order.
pub fn plan() -> Vec<(DesignPoint, Use)> {
    let formula = Formula::new(&Rig::fe());
    let mut all = Vec::new();
    for kind in Kind::ALL {
        for of in [Use::Fit, Use::Tame, Use::Hold] {
            all.extend(design::cases(&formula, kind, of).into_iter().map(|case| (case, of)));
        }
    }
    all
}

/// The crossings of the file in place.
pub fn stored() -> Result<Vec<Row>> {
    let path = data::path();
    let text = std::fs::read_to_string(&path).with_context(|| format!("{}", path.display()))?;
    data::read(&text)
}

/// The source of `src/model/constants.rs` that follows from the crossings.
pub fn source(rows: &[Row]) -> Result<String> {
    let formula = Formula::new(&Rig::fe());
    let mut source = String::from(
        "//! Coefficients of the effective stiffness in 1e-8, in the order of\n\
         //! [`Kind::terms`](super::effective_stiffness::Kind::terms). Written by `rig-study constants` from\n\
         //! crossings of the converged ring; do not edit.\n",
    );
    for kind in Kind::ALL {
        let coefficients = fit::fit(&formula, kind, rows).context(data::kind_name(kind))?;
        let (name, doc) = match (kind.direction, kind.driven) {
            (Direction::Deploy, true) => ("DEPLOY", "Deploying, driven by friction."),
            (Direction::Deploy, false) => ("DEPLOY_PUSHED", "Deploying, pushed and frictionless."),
            (Direction::Retract, true) => ("RETRACT", "Retracting, driven by friction."),
            (Direction::Retract, false) => {
                ("RETRACT_PUSHED", "Retracting, pushed and frictionless.")
            }
        };
        let count = coefficients.len();
        let _ =
            write!(source, "\n/// {doc}\n#[rustfmt::skip]\npub const {name}: [i32; {count}] = [");
        for (index, value) in coefficients.iter().enumerate() {
            let bits = (value * 1e8).round();
            ensure!(bits.abs() < 2e9, "coefficient {index} of {name} is {value}");
            let _ = write!(source, "{}{bits},", if index % 8 == 0 { "\n    " } else { " " });
        }
        source.push_str("\n];\n");
    }
    Ok(source)
}
