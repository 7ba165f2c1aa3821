//! Schemas of the messages that carry a log to other programs.

use serde_json::{Value, json};

use crate::export::json;
use crate::log::{LedgerLine, Row};

/// Of a [`Row`].
pub(crate) fn rows() -> Value {
    let example = json!(Row {
        wheel_code: Some(0),
        wheel_at: Some(0),
        load_cell_code: Some(0),
        load_cell_at: Some(0),
        tread_code: Some(0),
        tread_at: Some(0),
        arm_code: Some(0),
        arm_at: Some(0),
        drive_code: Some(0),
        pretightener_code: Some(0),
        ..Row::default()
    });
    json::schema("interstage.Controller", &example, &["tick", "t_s", "mode"])
}

/// Of a [`LedgerLine`].
pub(crate) fn ledger() -> Value {
    json::schema("interstage.Ledger", &json!(LedgerLine::default()), &["index", "count"])
}
