//! Sections of a scenario whose keys are numbers of the plant: a row a key.

/// A key of a section.
#[derive(Clone, Copy, Debug)]
pub struct Field<T> {
    /// Its name.
    pub name: &'static str,
    /// Value of the usual rigs.
    pub usual: f64,
    /// Values that it takes.
    pub range: (f64, f64),
    /// Range of the wide draw; none if it is not drawn.
    pub wide: Option<(f64, f64)>,
    /// Its place.
    pub(super) of: fn(&mut T) -> &mut f64,
}

/// A section.
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
