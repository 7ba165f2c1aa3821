//! Texts for operators: each code has a sentence of its own.

use std::collections::HashSet;
use std::fmt::Debug;

use interstage::fault::{Fault, Limit};
use interstage::params::Refusal;
use interstage::params::{SCHEMA, SetError};

fn differ<T: Copy + Debug>(all: &[T], say: impl Fn(T) -> &'static str) {
    let mut said = HashSet::new();
    for one in all {
        let text = say(*one);
        assert!(text.len() > 6 && text.starts_with(char::is_lowercase), "{one:?}: {text}");
        assert!(!text.ends_with('.') && said.insert(text), "{one:?}: {text}");
    }
}

#[test]
fn faults_and_limits() {
    differ(&Fault::ALL, Fault::sentence);
    differ(&Limit::ALL, Limit::sentence);
    let everything =
        Fault::ALL.map(Fault::sentence).into_iter().chain(Limit::ALL.map(Limit::sentence));
    assert_eq!(everything.collect::<HashSet<_>>().len(), Fault::ALL.len() + Limit::ALL.len());
}

#[test]
fn refusals() {
    use Refusal::{Damaged, Flash, Length, Moving, NoDraft, Piece, Schema};
    differ(&[Moving, NoDraft, Length, Piece, Flash, Damaged, Schema], Refusal::sentence);
}

#[test]
fn sets_that_cannot_be_read() {
    let errors =
        [SetError::Short, SetError::Damaged, SetError::Schema { found: 77 }, SetError::Content];
    differ(&errors, SetError::sentence);
    for error in errors {
        assert!(error.to_string().starts_with(error.sentence()), "{error}");
    }
    let schema = errors[2].to_string();
    assert!(schema.contains("77") && schema.contains(&SCHEMA.to_string()), "{schema}");
}
