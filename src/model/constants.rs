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
    0, -2134, -4045, -5327, -5653, -4780, -2535, 1186,
    6439, 13234, 21558, 31388, 42701, 55493, 69788, 85649,
    103186, 122560, 143981, 167705, 194023, 223247, 255684, 291609,
    331229, 374630, 421730, 472209, 525434, 580376, 635508, 688694,
    737071,
];
