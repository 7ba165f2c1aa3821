//! Sections of a scenario whose keys are numbers of the plant, a row a key: how far the plant
//! may differ from the rig as the controller knows it.

use documented::DocumentedFields;
use serde::{Deserialize, Serialize};

/// A key of a section.
#[derive(Clone, Copy, Debug)]
pub struct Field<T> {
    pub name: &'static str,
    /// Value of the usual rigs.
    pub usual: f64,
    pub range: (f64, f64),
    /// Range of the wide draw; none if it is not drawn.
    pub wide: Option<(f64, f64)>,
    pub(super) of: fn(&mut T) -> &mut f64,
}

pub trait Section: Clone + 'static {
    /// All keys, in the order in which they are drawn: a new one comes last.
    const FIELDS: &'static [Field<Self>];

    /// That of the usual rigs.
    fn usual() -> Self;

    /// Every key with its value.
    fn values(&self) -> impl Iterator<Item = (&'static Field<Self>, f64)> {
        let mut all = self.clone();
        Self::FIELDS.iter().map(move |field| (field, *(field.of)(&mut all)))
    }
}

/// Declares a section. A row is a key's text, its name, usual value and range, and the range of
/// the wide draw if it is drawn.
macro_rules! section {
    (@wide) => { None };
    (@wide $wide:expr) => { Some($wide) };
    ($(#[$about:meta])* $name:ident {
        $($(#[$text:meta])* $key:ident: $usual:expr, $range:expr $(, $wide:expr)?;)*
    }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, DocumentedFields)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[$text])* pub $key: f64,)*
        }

        impl Section for $name {
            const FIELDS: &'static [Field<Self>] = &[$(Field {
                name: stringify!($key),
                usual: $usual,
                range: $range,
                wide: section!(@wide $($wide)?),
                of: |section| &mut section.$key,
            }),*];

            fn usual() -> Self {
                Self { $($key: $usual),* }
            }
        }
    };
}
pub(super) use section;

section! {
    /// Width of the per-seed draw of the plant. Keys in `_rel` are standard deviations
    /// relative to the nominal value; keys with a unit are half-widths about it. By default every
    /// seed draws the nominal plant.
    #[derive(Default)]
    Spread {
        /// Relaxed stiffness of the tread, relative.
        k_inf_rel: 0.04, (0.0, 0.3);
        /// Stiffening of the tread, relative.
        stiffening_rel: 0.03, (0.0, 0.3);
        /// Relaxation time of the tread, relative.
        tau_rel: 0.05, (0.0, 0.3);
        /// Friction of tread on wall, relative.
        mu_rel: 0.03, (0.0, 0.3);
        /// Top load, relative.
        top_load_rel: 0.05, (0.0, 0.3);
        /// Position of each step, mm.
        step_position_mm: 0.3, (0.0, 5.0);
        /// Height of each step, mm.
        step_height_mm: 0.05, (0.0, 0.5);
        /// Wheel radius as made, mm.
        wheel_radius_mm: 0.05, (0.0, 1.0);
        /// Loss of wheel radius by wear, mm: drawn from 0 to this.
        wear_mm: 0.05, (0.0, 2.0);
        /// Rate of the preload spring, relative.
        spring_rel: 0.05, (0.0, 0.3);
        /// Dead time of the pre-tightener, relative.
        delay_rel: 0.15, (0.0, 0.3);
        /// Lag of the pre-tightener, relative.
        lag_rel: 0.15, (0.0, 0.3);
        /// Largest rate of the pre-tightener, relative.
        slew_rel: 0.05, (0.0, 0.3);
        /// Gain of the preload sensor, relative.
        preload_sensor_gain_rel: 0.005, (0.0, 0.1);
        /// Gain of the compression sensor, relative.
        compression_sensor_gain_rel: 0.005, (0.0, 0.1);
        /// Zero of the arm angle sensor, degrees.
        arm_angle_zero_deg: 0.05, (0.0, 2.0);
        /// Supply of the bridges, relative.
        supply_rel: 0.006, (0.0, 0.1);
        /// Dividers of their readback, relative.
        readback_gain_rel: 0.002, (0.0, 0.1);
        /// Zero of their readback, parts of the supply: standard deviation.
        readback_zero_duty: 0.002, (0.0, 0.1);
        /// Time constant of their readback, relative.
        readback_lag_rel: 0.05, (0.0, 0.3);
    }
}
