//! Strings out of a closed set. [`choice!`] declares one.

use super::{
    context::Context,
    read::{Value, kind},
    table::list,
};
use crate::diagnostic::quote;

/// Which of `names` a value is. `later` are names that are planned.
pub(super) fn choose<'n>(
    value: &Value,
    names: &[&'n str],
    later: &[&str],
    cx: &mut Context,
) -> Option<&'n str> {
    let Some(given) = value.get_ref().as_str() else {
        cx.must(value.span(), &format!("one of {}", list(names)), kind(value));
        return None;
    };
    if let Some(name) = names.iter().copied().find(|name| *name == given) {
        return Some(name);
    }
    let key = cx.key.clone();
    if later.contains(&given) {
        cx.error(value.span(), format!("`{key}` \"{given}\" is not there yet"))
            .help(format!("for now: one of {}", list(names)));
        return None;
    }
    let help = match cx.suggest(given, |_| names.to_vec()) {
        Some(near) => near,
        None => format!("one of {}", list(names)),
    };
    cx.error(value.span(), format!("`{key}` cannot be {}", quote(given))).help(help);
    None
}

/// `choice! { /// doc … enum Name { "text" => Variant, … } later "text" … }`
macro_rules! choice {
    (
        $(#[doc = $doc:literal])*
        enum $name:ident { $($text:literal => $variant:ident),* $(,)? } $(later $($later:literal)*)?
    ) => {
        $(#[doc = $doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
        pub(super) enum $name {
            $(#[serde(rename = $text)] $variant,)*
        }

        impl $crate::scene::read::Read for $name {
            fn read(value: &$crate::scene::read::Value, cx: &mut $crate::scene::context::Context) -> Option<Self> {
                match $crate::scene::choice::choose(value, &[$($text),*], &[$($($later),*)?], cx)? {
                    $($text => Some(Self::$variant),)*
                    _ => None,
                }
            }
        }

        $crate::scene::table::inline_schema! {
            $name, _generator: schemars::json_schema!({ "enum": [$($text),*] }),
        }
    };
}

pub(super) use choice;
