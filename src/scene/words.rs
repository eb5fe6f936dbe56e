//! Enums whose variants have one word each: in scene files, on the command line and in messages.

/// Defines such an enum. Its `name` is the word by which serde knows the variant.
macro_rules! words {
    (
        $(#[$attribute:meta])*
        pub enum $Name:ident {
            $($(#[$of_variant:meta])* $Variant:ident = $word:literal,)*
        }
    ) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        $(#[$attribute])*
        pub enum $Name {
            $($(#[$of_variant])* #[serde(rename = $word)] $Variant,)*
        }

        impl $Name {
            /// The word that users write.
            pub const fn name(self) -> &'static str {
                match self {
                    $($Name::$Variant => $word,)*
                }
            }
        }
    };
}

pub(super) use words;
