//! Taxels that no letter reads, and the fields that have no other.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::body::{Body, Modality};
use crate::error::{Error, Result};
use crate::field::{Field, FieldSet};
use crate::percept::TouchOutputs;
use crate::signal::Letter;

/// What of a plan's fields is left out.
#[derive(Clone, Debug, Default)]
pub(crate) struct LeftOut {
    /// By the name of a modality, the ids of the taxels, ascending.
    taxels: BTreeMap<String, Vec<u32>>,
    /// Names of fields that have no taxel that is read.
    fields: Vec<String>,
}

impl LeftOut {
    /// What the fields `chosen` of `fields` leave out in `letters`.
    pub(super) fn from_fields(body: &Body, chosen: &[usize], fields: &FieldSet, letters: &[Letter]) -> Self {
        let mut taxels: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        let is_read = |taxel: usize| letters.iter().any(|letter| letter.receptor.reads(body.taxels[taxel].modality));
        let chosen = || chosen.iter().map(|&field| &fields.fields[field]);
        for member in chosen().flat_map(|field| &field.members).filter(|member| !is_read(member.taxel)) {
            let taxel = &body.taxels[member.taxel];
            taxels.entry(taxel.modality.name()).or_default().push(taxel.id);
        }
        for ids in taxels.values_mut() {
            ids.sort_unstable();
            ids.dedup();
        }
        let feels_nothing = |field: &&Field| !field.members.iter().any(|member| is_read(member.taxel));
        Self { taxels, fields: chosen().filter(feels_nothing).map(|field| field.name.clone()).collect() }
    }

    /// The fields of `chosen` that have a taxel that is read.
    ///
    /// # Errors
    /// None has.
    pub(super) fn feeling(&self, body: &Body, chosen: Vec<usize>, fields: &FieldSet) -> Result<Vec<usize>> {
        let left: Vec<usize> =
            chosen.into_iter().filter(|&field| !self.fields.contains(&fields.fields[field].name)).collect();
        if left.is_empty() {
            let what = format!("no field has a taxel that a letter reads: {}", self.remark().unwrap_or_default());
            return Err(Error::failed(what).at(&body.name));
        }
        Ok(left)
    }

    /// Without the temperatures that touches have, if `touches` are given them; fields that have no other taxels are still told.
    pub(super) fn but_for(mut self, touches: Option<TouchOutputs>) -> Self {
        if self.fields.is_empty() && touches.is_some_and(|outputs| outputs.contains(TouchOutputs::TEMPERATURE)) {
            self.taxels.remove(&Modality::Temperature.name());
        }
        self
    }

    /// What is left out, in a line; none where nothing is.
    pub(crate) fn remark(&self) -> Option<String> {
        if self.taxels.is_empty() {
            return None;
        }
        let kind = |(name, ids): (&String, &Vec<u32>)| match ids[..] {
            [id] => format!("taxel {id} measures {name}"),
            [first, ..] => format!("{} taxels measure {name}, such as {first}", ids.len()),
            [] => String::new(),
        };
        let mut line = format!(
            "{}; no letter that is asked for reads that: left out of every field",
            self.taxels.iter().map(kind).collect::<Vec<_>>().join(", ")
        );
        match &self.fields[..] {
            [] => {}
            [only] => line += &format!("; field `{only}` has no other, and is left out"),
            [first, ..] => {
                let count = self.fields.len();
                line += &format!("; {count} fields have no other, such as `{first}`, and are left out");
            }
        }
        Some(line)
    }
}

pub(super) fn is_pressure(body: &Body, taxel: usize) -> bool {
    body.taxels[taxel].modality.is_pressed()
}

/// `field` with its members of pressure alone. Its chart is the layout's own.
pub(super) fn pressed_members<'f>(body: &Body, field: &'f Field) -> Cow<'f, Field> {
    if field.members.iter().all(|member| is_pressure(body, member.taxel)) {
        return Cow::Borrowed(field);
    }
    let mut pressed = field.clone();
    pressed.members.retain(|member| is_pressure(body, member.taxel));
    Cow::Owned(pressed)
}
