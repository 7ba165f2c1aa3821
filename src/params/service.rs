//! Reading and replacing the stored parameters, request by request.
//!
//! The host reads the set in force in pieces, makes a new one and sends it back. The board
//! checks the complete set before it comes into force. The running controller does not change:
//! a new set applies from the next start on.

use serde::{Deserialize, Serialize};

use super::slots::{Damaged, Draft, SetMemory, stored};
use super::{MAX_NAME, ParameterSet, Refusal, SCHEMA};
use crate::supervise::ServiceDuties;

/// Most bytes of a set in one request or answer; full double words.
pub const PIECE: usize = 48;

/// Bytes of a set.
pub type Piece = heapless::Vec<u8, PIECE>;

/// Requests of the host.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request {
    /// Describe the set in force.
    Describe,
    /// Read a piece of the set in force.
    Read {
        /// From this byte on.
        offset: u16,
    },
    /// Make room for a new set.
    Begin {
        /// Its bytes.
        length: u16,
    },
    /// Append the next piece of it.
    Append(Piece),
    /// Check it and put it in force.
    Seal,
    /// Put the set of the image in force.
    Restore,
    /// Restart, with the set then in force.
    Restart,
    /// Enter the service mode from idle, or drive in it; see
    /// [`service`](crate::supervise::service). To be repeated while it shall last.
    Service(ServiceDuties),
    /// Leave the service mode, or a fault hold, through the self-test.
    Reset,
}

/// Answers of the board.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Response {
    /// To [`Request::Describe`].
    Description(Description),
    /// To [`Request::Read`]; empty beyond the end.
    Piece(Piece),
    /// Done.
    Done,
    /// Not done; the set in force is unchanged.
    Refused(Refusal),
}

/// The set in force.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Description {
    /// Where it is stored.
    pub origin: Origin,
    /// Its bytes.
    pub length: u16,
    /// Its schema.
    pub schema: u16,
    /// The firmware's schema: a set of another one is kept and not run.
    pub expected: u16,
    /// Name of the rig.
    pub name: heapless::String<MAX_NAME>,
    /// Hash of its parameters.
    pub parameters: u32,
    /// Hash of the parameters that the controller runs on.
    pub running: u32,
}

/// Where a set is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Origin {
    /// In the image: nothing is stored.
    Image,
    /// In flash.
    Stored {
        /// Number of sets stored so far.
        sequence: u32,
    },
}

/// Answers requests.
#[derive(Debug)]
pub struct Service<M> {
    memory: M,
    /// Set of the image.
    image: &'static [u8],
    /// Hash of the parameters that run.
    running: u32,
    draft: Option<Draft>,
}

impl<M: SetMemory> Service<M> {
    /// A service over this flash, with the set of the image and the hash of the running parameters.
    pub const fn new(memory: M, image: &'static [u8], running: u32) -> Self {
        Self { memory, image, running, draft: None }
    }

    /// Answers one request. Unless the drive is `at_rest`, the stored set cannot change. To
    /// [`Request::Restart`] this answers [`Response::Done`]; the caller restarts.
    pub async fn answer(&mut self, request: Request, at_rest: bool) -> Response {
        let answer = match request {
            Request::Describe => self.describe(),
            Request::Read { offset } => self.read(offset),
            _ if !at_rest => Err(Refusal::Moving),
            request => self.change(request).await.map(|()| Response::Done),
        };
        answer.unwrap_or_else(Response::Refused)
    }

    async fn change(&mut self, request: Request) -> Result<(), Refusal> {
        match request {
            Request::Begin { length } => {
                self.draft = None;
                self.draft = Some(Draft::begin(&mut self.memory, length.into()).await?);
            }
            Request::Append(piece) => {
                let draft = self.draft.as_mut().ok_or(Refusal::NoDraft)?;
                draft.append(&mut self.memory, &piece).await?;
            }
            Request::Seal => {
                let draft = self.draft.take().ok_or(Refusal::NoDraft)?;
                draft.seal(&mut self.memory).await?;
            }
            Request::Restore => {
                self.draft = None;
                if in_force(&self.memory, self.image).map(|(_, set)| set) != Ok(self.image) {
                    let mut draft = Draft::begin(&mut self.memory, self.image.len()).await?;
                    draft.append(&mut self.memory, self.image).await?;
                    draft.seal(&mut self.memory).await?;
                }
            }
            // A restart is the caller's, service mode and reset are the tick's.
            _ => {}
        }
        Ok(())
    }

    fn describe(&self) -> Result<Response, Refusal> {
        let (origin, set) = in_force(&self.memory, self.image)?;
        let opened = ParameterSet::open_any(set).map_err(|_| Refusal::Lost)?;
        let header = opened.header();
        Ok(Response::Description(Description {
            origin,
            length: set.len() as u16,
            schema: header.schema,
            expected: SCHEMA,
            name: header.name.clone(),
            parameters: header.parameters,
            running: self.running,
        }))
    }

    fn read(&self, offset: u16) -> Result<Response, Refusal> {
        let (_, set) = in_force(&self.memory, self.image)?;
        let piece = set.iter().skip(offset.into()).take(PIECE).copied().collect();
        Ok(Response::Piece(piece))
    }
}

/// The set in force: the stored one, or that of the image if none is stored.
///
/// # Errors
/// [`Damaged`] if the stored one is damaged: no other one replaces it.
pub fn in_force<'m>(
    memory: &'m impl SetMemory,
    image: &'static [u8],
) -> Result<(Origin, &'m [u8]), Damaged> {
    Ok(match stored(memory)? {
        Some(stored) => (Origin::Stored { sequence: stored.sequence }, stored.set),
        None => (Origin::Image, image),
    })
}

#[cfg(test)]
mod tests {
    use super::super::MAX_SET;
    use super::super::slots::tests::{Flash, set};
    use super::*;
    use embassy_futures::block_on;

    fn service() -> Service<Flash> {
        Service::new(Flash::blank(), set("image").leak(), 7)
    }

    fn ask(service: &mut Service<Flash>, request: Request) -> Response {
        block_on(service.answer(request, true))
    }

    fn send(service: &mut Service<Flash>, set: &[u8]) -> Response {
        let begun = ask(service, Request::Begin { length: set.len() as u16 });
        assert_eq!(begun, Response::Done);
        for piece in set.chunks(PIECE) {
            let piece = Piece::from_slice(piece).unwrap();
            assert_eq!(ask(service, Request::Append(piece)), Response::Done);
        }
        ask(service, Request::Seal)
    }

    fn read(service: &mut Service<Flash>) -> Vec<u8> {
        let mut all = Vec::new();
        loop {
            match ask(service, Request::Read { offset: all.len() as u16 }) {
                Response::Piece(piece) if piece.is_empty() => return all,
                Response::Piece(piece) => all.extend(piece),
                other => panic!("{other:?}"),
            }
        }
    }

    fn origin(service: &mut Service<Flash>) -> (Origin, String) {
        match ask(service, Request::Describe) {
            Response::Description(description) => {
                assert_eq!(description.running, 7);
                assert_eq!(description.schema, SCHEMA);
                (description.origin, description.name.as_str().to_owned())
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_set_is_read_replaced_and_restored() {
        let mut service = service();
        assert_eq!(origin(&mut service), (Origin::Image, "image".into()));
        assert_eq!(read(&mut service), set("image"));
        assert_eq!(send(&mut service, &set("mine")), Response::Done);
        assert_eq!(origin(&mut service), (Origin::Stored { sequence: 1 }, "mine".into()));
        assert_eq!(read(&mut service), set("mine"));
        for _ in 0..2 {
            assert_eq!(ask(&mut service, Request::Restore), Response::Done);
            assert_eq!(origin(&mut service), (Origin::Stored { sequence: 2 }, "image".into()));
        }
    }

    #[test]
    fn a_rejected_set_leaves_the_old_one() {
        let mut service = service();
        send(&mut service, &set("mine"));
        let mut damaged = set("damaged");
        damaged[50] ^= 4;
        assert_eq!(send(&mut service, &damaged), Response::Refused(Refusal::Damaged));
        assert_eq!(read(&mut service), set("mine"));
        assert_eq!(ask(&mut service, Request::Seal), Response::Refused(Refusal::NoDraft));
        let long = Request::Begin { length: MAX_SET as u16 + 1 };
        assert_eq!(ask(&mut service, long), Response::Refused(Refusal::Length));
        assert_eq!(read(&mut service), set("mine"));
    }

    #[test]
    fn a_damaged_set_is_told_and_can_be_replaced() {
        let mut service = service();
        type Repair = fn(&mut Service<Flash>) -> Response;
        let restore: Repair = |service| ask(service, Request::Restore);
        let replace: Repair = |service| send(service, &set("again"));
        for (repair, name) in [(restore, "image"), (replace, "again")] {
            send(&mut service, &set("mine"));
            service.memory.flip(500);
            for request in [Request::Describe, Request::Read { offset: 0 }] {
                assert_eq!(ask(&mut service, request), Response::Refused(Refusal::Lost));
            }
            assert_eq!(repair(&mut service), Response::Done);
            assert_eq!(origin(&mut service).1, name);
        }
    }

    #[test]
    fn nothing_is_changed_while_the_drive_moves() {
        let mut service = service();
        for request in [
            Request::Begin { length: 8 },
            Request::Append(Piece::new()),
            Request::Seal,
            Request::Restore,
            Request::Restart,
        ] {
            let refused = block_on(service.answer(request, false));
            assert_eq!(refused, Response::Refused(Refusal::Moving));
        }
        assert!(matches!(
            block_on(service.answer(Request::Describe, false)),
            Response::Description(_)
        ));
    }
}
