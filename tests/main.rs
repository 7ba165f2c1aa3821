//! The library from outside: its tasks on a mocked board under virtual time, recorded runs,
//! damaged input, and what it says in words.

mod common;

mod fuzz;
mod prescribed_speed;
mod replay;
mod tasks_background;
mod tasks_link;
mod tasks_motors;
mod tasks_sensors;
mod tasks_service;
mod words;
