//! Part of the stiffening that a crossing feels, in millionths, at equal steps of
//! z = De/(1 + De) from 0 to 1. Written by `cargo rig constants` from crossings of
//! the converged ring; do not edit.

/// Way out: the wheel climbs.
#[rustfmt::skip]
pub const DEPLOY: [i32; 33] = [
    0, 21893, 56456, 97792, 141965, 186521, 230088, 272047,
    312263, 350879, 388161, 424387, 459778, 494461, 528464, 561723,
    594119, 625509, 655773, 684851, 712773, 739675, 765794, 791433,
    816897, 842389, 867855, 892787, 915961, 935113, 946548, 946548,
    946548,
];

/// Way back: the wheel drops off.
#[rustfmt::skip]
pub const RETRACT: [i32; 33] = [
    0, -2132, -4045, -5328, -5655, -4780, -2533, 1192,
    6447, 13243, 21567, 31394, 42702, 55488, 69777, 85632,
    103164, 122532, 143948, 167668, 193981, 223199, 255629, 291546,
    331158, 374556, 421662, 472169, 525459, 580524, 635869, 689402,
    738314,
];
