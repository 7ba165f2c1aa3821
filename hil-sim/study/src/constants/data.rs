//! The crossings of the ring behind the reduced model, as a file.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use interstage::model::effective_stiffness::Kind;
use interstage::rig::Rig;
use interstage::units::Direction;
use rayon::prelude::*;

use super::design::{DesignPoint, Use};
use hil_sim::plant::balance::Axial;
use hil_sim::plant::crossing::{CrossingCase, cross};
use hil_sim::plant::ring::RingParameters;

/// Elements around the ring. With the stride below, twice the elements at half of it
/// move no gap by more than a fiftieth of what the model may be off.
pub const ELEMENTS: usize = 2880;
/// Axial travel per step, mm.
pub const STRIDE_MM: f64 = 0.01;

/// A crossing and what the ring makes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The crossing.
    pub case: DesignPoint,
    /// What it is for.
    pub of: Use,
    /// Gap, mm; 0 where the wheel sinks in so far that there is none.
    pub gap_mm: f64,
    /// Friction utilisation at lift-off; 0 if pushed.
    pub utilisation: f64,
    /// Largest axial force of the contact, N.
    pub corner_force_n: f64,
}

/// Where the file is.
pub fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data/crossings.csv")
}

/// The ring's answer at a resolution.
pub fn run(case: &DesignPoint, of: Use, elements: usize, stride_mm: f64) -> Result<Row> {
    let result = cross(&CrossingCase {
        ring: RingParameters::of(&Rig::fe(), elements),
        step_height_mm: case.step_mm,
        speed_mm_s: case.speed_mm_s * f64::from(case.kind.direction.sign()),
        preload_n: case.preload_n,
        axial: if case.kind.driven { Axial::Driven(case.load_n) } else { Axial::Pushed },
        stride_mm,
    })
    .with_context(|| format!("{case:?}"))?;
    // As the file holds it.
    let cut = |value: f64| (value * 1e9).round() / 1e9;
    Ok(Row {
        case: *case,
        of,
        gap_mm: cut(result.gap_mm),
        utilisation: cut(result.lift_utilisation),
        corner_force_n: cut(result.corner_force_n),
    })
}

/// Runs crossings on all cores.
pub fn run_all(cases: &[(DesignPoint, Use)], progress: &(dyn Fn() + Sync)) -> Result<Vec<Row>> {
    cases
        .par_iter()
        .map(|(case, of)| {
            let row = run(case, *of, ELEMENTS, STRIDE_MM);
            progress();
            row
        })
        .collect()
}

/// The file's text.
pub fn write(rows: &[Row]) -> String {
    let mut text = format!(
        "# Crossings of the ring, {ELEMENTS} elements, {STRIDE_MM} mm a step. Written by \
         `rig-study constants`; do not edit.\n\
         kind,use,step_mm,speed_mm_s,preload_n,load_n,gap_mm,utilisation,corner_force_n\n"
    );
    for Row { case, of, gap_mm, utilisation, corner_force_n } in rows {
        let DesignPoint { kind, step_mm, speed_mm_s, preload_n, load_n } = case;
        let line = format!(
            "{},{},{step_mm},{speed_mm_s},{preload_n},{load_n},{gap_mm},{utilisation},{corner_force_n}\n",
            kind_name(*kind),
            use_name(*of),
        );
        text.push_str(&line);
    }
    text
}

/// The crossings of a file's text.
pub fn read(text: &str) -> Result<Vec<Row>> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    reader
        .records()
        .map(|record| {
            let record = record?;
            let line = record.position().map_or(0, csv::Position::line);
            row(&record).with_context(|| format!("crossings.csv, line {line}"))
        })
        .collect()
}

fn row(record: &csv::StringRecord) -> Result<Row> {
    ensure!(record.len() == 9, "{} columns, expected 9", record.len());
    let number = |index: usize| -> Result<f64> {
        record[index].parse().with_context(|| format!("{:?} is not a number", &record[index]))
    };
    let kind = Kind::ALL.into_iter().find(|kind| kind_name(*kind) == &record[0]);
    let of = [Use::Fit, Use::Tame, Use::Hold].into_iter().find(|of| use_name(*of) == &record[1]);
    Ok(Row {
        case: DesignPoint {
            kind: kind.with_context(|| format!("no kind {:?}", &record[0]))?,
            step_mm: number(2)?,
            speed_mm_s: number(3)?,
            preload_n: number(4)?,
            load_n: number(5)?,
        },
        of: of.with_context(|| format!("no use {:?}", &record[1]))?,
        gap_mm: number(6)?,
        utilisation: number(7)?,
        corner_force_n: number(8)?,
    })
}

/// Name of a kind in file and messages.
pub fn kind_name(kind: Kind) -> &'static str {
    match (kind.direction, kind.driven) {
        (Direction::Deploy, true) => "climb",
        (Direction::Deploy, false) => "climb_pushed",
        (Direction::Retract, true) => "drop",
        (Direction::Retract, false) => "drop_pushed",
    }
}

fn use_name(of: Use) -> &'static str {
    match of {
        Use::Fit => "fit",
        Use::Tame => "tame",
        Use::Hold => "hold",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let row = |kind, of, load_n| Row {
            case: DesignPoint { kind, step_mm: 2.5, speed_mm_s: 31.25, preload_n: 40.0, load_n },
            of,
            gap_mm: 1.234_567_891,
            utilisation: 0.25,
            corner_force_n: 17.5,
        };
        let rows = [
            row(Kind::ALL[0], Use::Fit, 6.7),
            row(Kind::ALL[3], Use::Hold, 0.0),
            row(Kind::ALL[2], Use::Tame, 1.0),
        ];
        assert_eq!(read(&write(&rows)).unwrap(), rows);
    }

    #[test]
    fn a_bad_line_is_named() {
        let text = write(&[]) + "climb,fit,1,2,3,4,x,6,7\n";
        let error = format!("{:#}", read(&text).unwrap_err());
        assert!(error.contains("line 3") && error.contains("\"x\""), "{error}");
        assert!(read(&(write(&[]) + "slide,fit,1,2,3,4,5,6,7\n")).is_err());
    }
}
