//! Tables whose keys are checked, and the types of single values.

use super::error::{At, Fault, Place, shorten};
use super::keys::{self, nearest, one_of};
use super::limits::{MAX_MAGNITUDE, MAX_NAME, MIN_MAGNITUDE};
use super::value::{Entry, Kind, Value};

/// What a number must be.
pub(super) const FINITE: &str = "a finite number of magnitude at most 1e100";
/// What a weight must be.
pub(super) const WEIGHT: &str = "a finite number greater than 0, at most 1e100";
/// What a length must be.
pub(super) const LENGTH: &str = "a length greater than 0 (1e-100 to 1e100)";

/// A table whose keys are all known.
pub(super) struct Fields<'a> {
    entries: &'a [Entry],
    place: Place,
    keys: &'static [&'static str],
}

impl<'a> Fields<'a> {
    /// The entries of a table; any key outside `keys` is an error.
    pub(super) fn new(
        value: &'a Value,
        keys: &'static [&'static str],
        wanted: &str,
    ) -> Result<Self, Fault> {
        let entries = entries(value, wanted)?;
        for entry in entries {
            if !keys.contains(&entry.key.as_str()) {
                let key = &entry.key;
                // A key that is there already cannot be what was meant.
                let free = |near: &&str| find(entries, near).is_none();
                let candidates = || keys.iter().copied().filter(free);
                let hint = keys::meant(key, candidates()).or_else(|| {
                    nearest(key, candidates()).map(|near| format!("did you mean `{near}`?"))
                });
                return Err(Fault::found(
                    entry.key_place,
                    format!("unknown key `{}`", shorten(key)),
                    one_of(keys.iter().copied()),
                )
                .with_hint(hint)
                .at_key(key));
            }
        }
        Ok(Self {
            entries,
            place: value.place,
            keys,
        })
    }

    /// Where the table is.
    pub(super) fn place(&self) -> Place {
        self.place
    }

    pub(super) fn get(&self, key: &str) -> Option<&'a Value> {
        debug_assert!(self.keys.contains(&key), "{key} is not in its list");
        find(self.entries, key)
    }

    /// The value of an optional key.
    pub(super) fn read<T>(
        &self,
        key: &str,
        read: impl FnOnce(&'a Value) -> Result<T, Fault>,
    ) -> Result<Option<T>, Fault> {
        self.get(key).map(read).transpose().at_key(key)
    }

    /// The value of a key that must be there.
    pub(super) fn need<T>(
        &self,
        key: &str,
        wanted: &str,
        read: impl FnOnce(&'a Value) -> Result<T, Fault>,
    ) -> Result<T, Fault> {
        match self.read(key, read)? {
            Some(value) => Ok(value),
            None => Err(missing(self.place, key, wanted)),
        }
    }
}

pub(super) fn find<'a>(entries: &'a [Entry], key: &str) -> Option<&'a Value> {
    entries
        .iter()
        .find(|entry| entry.key == key)
        .map(|entry| &entry.value)
}

pub(super) fn missing(place: Place, key: &str, wanted: &str) -> Fault {
    Fault::found(place, format!("no key `{key}`"), wanted)
}

pub(super) fn entries<'a>(value: &'a Value, wanted: &str) -> Result<&'a [Entry], Fault> {
    match &value.kind {
        Kind::Table(entries) => Ok(entries),
        _ => Err(value.wrong_type(wanted)),
    }
}

pub(super) fn elements<'a>(value: &'a Value, wanted: &str) -> Result<&'a [Value], Fault> {
    match &value.kind {
        Kind::Array(elements) => Ok(elements),
        _ => Err(value.wrong_type(wanted)),
    }
}

/// Reads every element of an array.
pub(super) fn each<'a, T>(
    elements: &'a [Value],
    mut read: impl FnMut(usize, &'a Value) -> Result<T, Fault>,
) -> Result<Vec<T>, Fault> {
    elements
        .iter()
        .enumerate()
        .map(|(index, element)| read(index, element).at_index(index))
        .collect()
}

pub(super) fn string<'a>(value: &'a Value, wanted: &str) -> Result<&'a str, Fault> {
    match &value.kind {
        Kind::String(text) => Ok(text),
        _ => Err(value.wrong_type(wanted)),
    }
}

pub(super) fn boolean(value: &Value) -> Result<bool, Fault> {
    match value.kind {
        Kind::Bool(is) => Ok(is),
        _ => Err(value.wrong_type("true or false")),
    }
}

/// A name that can stand in a file header.
pub(super) fn name(value: &Value, wanted: &str) -> Result<String, Fault> {
    let text = string(value, wanted)?;
    name_text(text, value.place)?;
    Ok(text.to_owned())
}

pub(super) fn name_text(text: &str, place: Place) -> Result<(), Fault> {
    if text.is_empty()
        || text.chars().any(char::is_control)
        || text.chars().take(MAX_NAME + 1).count() > MAX_NAME
    {
        return Err(Fault::value(
            place,
            format!("a name of 1 to {MAX_NAME} characters, none of them a control character"),
        ));
    }
    Ok(())
}

/// A number, finite and of magnitude at most 1e100, for which `valid` holds.
pub(super) fn number(
    value: &Value,
    wanted: &str,
    valid: impl Fn(f64) -> bool,
) -> Result<f64, Fault> {
    #[allow(
        clippy::cast_precision_loss,
        reason = "an integer written for a real number means the nearest f64"
    )]
    let number = match value.kind {
        Kind::Integer(integer) => integer as f64,
        Kind::Float(number) => number,
        _ => return Err(value.wrong_type(wanted)),
    };
    if !(number.abs() <= MAX_MAGNITUDE && valid(number)) {
        return Err(Fault::value(value.place, wanted));
    }
    Ok(number)
}

pub(super) fn finite(value: &Value) -> Result<f64, Fault> {
    number(value, FINITE, |_| true)
}

pub(super) fn length(value: &Value) -> Result<f64, Fault> {
    number(value, LENGTH, |x| x >= MIN_MAGNITUDE)
}

pub(super) fn integer(value: &Value, low: u32, high: u32) -> Result<u32, Fault> {
    let wanted = || format!("an integer from {low} to {high}");
    match value.kind {
        Kind::Integer(found) => u32::try_from(found)
            .ok()
            .filter(|found| (low..=high).contains(found))
            .ok_or_else(|| Fault::value(value.place, wanted())),
        Kind::Float(_) => Err(Fault::value(value.place, wanted())),
        _ => Err(value.wrong_type(wanted())),
    }
}

/// One of a few names.
pub(super) fn choice<T: Copy>(value: &Value, names: &[(&'static str, T)]) -> Result<T, Fault> {
    let wanted = || one_of(names.iter().map(|(name, _)| *name));
    let text = string(value, &wanted())?;
    match names.iter().find(|(name, _)| *name == text) {
        Some((_, choice)) => Ok(*choice),
        None => Err(Fault::value(value.place, wanted()).with_hint(
            nearest(text, names.iter().map(|(name, _)| *name))
                .map(|near| format!("did you mean `{near}`?")),
        )),
    }
}

macro_rules! choices {
    ($name:ident) => {
        &$name::ALL
            .iter()
            .map(|choice| (choice.name(), *choice))
            .collect::<Vec<_>>()
    };
}

/// Several of a few names, each once.
pub(super) fn choice_list<T: Copy + PartialEq>(
    value: &Value,
    names: &[(&'static str, T)],
) -> Result<Vec<T>, Fault> {
    let wanted = format!(
        "an array of {}",
        names
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>()
            .join(", ")
    );
    let list = elements(value, &wanted)?;
    if list.is_empty() {
        return Err(Fault::value(value.place, wanted));
    }
    let mut seen = Vec::new();
    for (index, element) in list.iter().enumerate() {
        let found = choice(element, names).at_index(index)?;
        if seen.contains(&found) {
            return Err(Fault::value(element.place, "each name once").at_index(index));
        }
        seen.push(found);
    }
    Ok(seen)
}

/// Exactly `N` values.
pub(super) fn tuple<const N: usize, T: Copy + Default>(
    value: &Value,
    wanted: &str,
    read: impl Fn(&Value) -> Result<T, Fault>,
) -> Result<[T; N], Fault> {
    let list = elements(value, wanted)?;
    if list.len() != N {
        return Err(Fault::value(value.place, wanted));
    }
    let mut values = [T::default(); N];
    for (index, element) in list.iter().enumerate() {
        values[index] = read(element).at_index(index)?;
    }
    Ok(values)
}

pub(super) fn vector(value: &Value) -> Result<[f64; 3], Fault> {
    tuple(value, "a vector [x, y, z]", finite)
}

/// A vector that has a direction.
pub(super) fn direction(value: &Value) -> Result<[f64; 3], Fault> {
    let found = vector(value)?;
    if largest(found) < MIN_MAGNITUDE {
        return Err(Fault::value(
            value.place,
            "a direction: a vector [x, y, z] that is not zero",
        ));
    }
    Ok(found)
}

pub(super) fn largest(v: [f64; 3]) -> f64 {
    v.iter().fold(0.0, |most, c| c.abs().max(most))
}

/// The table of an item that has a `kind`, which decides the keys it may have.
pub(super) fn kinded<'a>(
    value: &'a Value,
    kinds: &'static [(&'static str, &'static [&'static str])],
    wanted: &str,
) -> Result<(&'static str, Fields<'a>), Fault> {
    let all = entries(value, wanted)?;
    let Some(kind) = find(all, "kind") else {
        // Without a kind, a slip in the key itself is the likeliest cause.
        let hint = all
            .iter()
            .find(|entry| nearest(&entry.key, ["kind"]).is_some())
            .map(|entry| format!("is `{}` meant to be `kind`?", shorten(&entry.key)));
        let names = one_of(kinds.iter().map(|(name, _)| *name));
        return Err(missing(value.place, "kind", &names).with_hint(hint));
    };
    let names: Vec<_> = kinds.iter().map(|kind| (kind.0, *kind)).collect();
    let (name, keys) = choice(kind, &names).at_key("kind")?;
    Ok((name, Fields::new(value, keys, wanted)?))
}

pub(super) use choices;
