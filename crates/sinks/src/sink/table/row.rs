//! A row of a table, and the values of its columns.

use std::borrow::Cow;

use crate::percept::{Column, Flags, Percepts, SelfContact, TOUCH_COLUMNS, Touch, TouchFlags, TouchFrame};
use crate::sink::{FieldNames, Session, SkinNames};

/// A column of a table.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TableColumn {
    /// Its name, such as `centroid_u`.
    pub name: String,
    /// What it is measured in, such as `m`; empty where that has no meaning.
    pub unit: String,
    /// The type of its values.
    pub kind: TableType,
    /// Whether a value may be absent.
    pub is_nullable: bool,
    /// What it is, in a line.
    pub help: String,
    pub(super) value: ValueOf,
}

/// The type of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableType {
    /// Double precision.
    F64,
    /// Single precision.
    F32,
    /// A whole number up to 2⁶⁴.
    U64,
    /// A whole number up to 2³².
    U32,
    /// True or false.
    Bool,
    /// One of few words: a dictionary.
    Word,
    /// A list of words.
    Words,
}

impl TableType {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
            Self::U64 => "u64",
            Self::U32 => "u32",
            Self::Bool => "bool",
            Self::Word => "dictionary of text",
            Self::Words => "list of text",
        }
    }
}

/// Where a column's values are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ValueOf {
    Recording,
    Time,
    Frame,
    Field,
    Link,
    Letter,
    Signal,
    Contact,
    Output(&'static Column, usize),
    Flags,
    OnSkin(OfTouch),
    ContactId,
    ContactPosition(usize),
    ContactDistance,
    ContactAngle,
    SideLink(usize),
    SideTouch(usize),
    SideTotal(usize),
}

/// What of a touch is not a number of [`TOUCH_COLUMNS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OfTouch {
    Id,
    Age,
    Link,
    In,
    Kind,
    Links,
    Fields,
    Taxels,
    Flags,
    /// A component of one of [`TOUCH_COLUMNS`], by its place there.
    Number(usize, usize),
    /// The same of a whole number.
    Whole(usize),
}

impl TableColumn {
    pub(super) fn new(name: &str, unit: &str, kind: TableType, help: &str, value: ValueOf) -> Self {
        let (name, unit, help) = (name.to_owned(), unit.to_owned(), help.to_owned());
        Self { name, unit, kind, is_nullable: false, help, value }
    }

    /// Its name with its unit, as in the header of a CSV: `total [P]`.
    #[must_use]
    pub fn title(&self) -> String {
        match self.unit.as_str() {
            "" | "1" => self.name.clone(),
            unit => format!("{} [{unit}]", self.name),
        }
    }

    pub(super) fn or_absent(self) -> Self {
        Self { is_nullable: true, ..self }
    }
}

/// The words of the columns of words.
pub(super) struct Words {
    pub(super) names: Vec<FieldNames>,
    /// If there are several, and which of them the rows are of now.
    pub(super) recordings: Vec<String>,
    pub(super) recording: usize,
    pub(super) skin: Option<SkinNames>,
    pub(super) flags: Vec<(Flags, String)>,
    pub(super) touch_flags: Vec<(TouchFlags, String)>,
}

impl Words {
    pub(super) fn new(session: &Session<'_>) -> Self {
        Self {
            names: session.names.clone(),
            recordings: session.recordings.to_vec(),
            recording: 0,
            skin: session.skin(),
            flags: Flags::all().iter_names().map(|(name, flag)| (flag, name.to_lowercase())).collect(),
            touch_flags: TouchFlags::all().iter_names().map(|(name, flag)| (flag, name.to_lowercase())).collect(),
        }
    }

    pub(super) fn link(&self, link: u32) -> Option<&str> {
        self.skin.as_ref()?.links.get(link as usize).map(String::as_str)
    }
}

/// A row of any of the tables.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    pub(super) percepts: &'a Percepts,
    pub(super) frame: usize,
    pub(super) field: usize,
    /// In the table of touches.
    pub(super) on_skin: Option<(&'a TouchFrame, &'a Touch)>,
    /// In the table of self-contacts.
    pub(super) contact: Option<&'a SelfContact>,
}

/// A number of a row, in double precision or as a whole number.
impl Row<'_> {
    pub(super) fn link<'n>(&self, names: &'n [FieldNames]) -> &'n str {
        match self.percepts.in_world(self.frame, self.field) {
            true => &names[self.field].world,
            false => &names[self.field].link,
        }
    }

    pub(super) fn float(&self, value: ValueOf) -> Option<f64> {
        match value {
            ValueOf::Time => Some(self.percepts.t_s(self.frame)),
            ValueOf::Output(column, component) => {
                self.percepts.value(self.frame, self.field, column).map(|components| components[component])
            }
            ValueOf::OnSkin(OfTouch::Age) => self.on_skin.map(|(_, touch)| touch.age_s),
            ValueOf::OnSkin(OfTouch::Number(column, component)) => {
                Some(TOUCH_COLUMNS[column].value(self.on_skin?.1)?[component])
            }
            ValueOf::ContactPosition(component) => self.contact.map(|contact| contact.position[component]),
            ValueOf::ContactDistance => self.contact.map(|contact| contact.distance),
            ValueOf::ContactAngle => self.contact.map(|contact| contact.angle),
            ValueOf::SideTotal(side) => self.contact.map(|contact| contact.sides[side].total),
            _ => None,
        }
    }

    pub(super) fn whole(&self, value: ValueOf) -> Option<u64> {
        match value {
            ValueOf::Frame => Some(self.percepts.frame_number(self.frame)),
            ValueOf::OnSkin(OfTouch::Id) => self.on_skin.map(|(_, touch)| touch.id),
            ValueOf::OnSkin(OfTouch::Whole(column)) => {
                let (_, touch) = self.on_skin?;
                TOUCH_COLUMNS[column].value(touch).map(|[number, ..]| number as u64)
            }
            ValueOf::ContactId => self.contact.map(|contact| contact.id),
            ValueOf::SideTouch(side) => self.contact.map(|contact| contact.sides[side].touch),
            ValueOf::Output(..) => self.float(value).map(|number| number as u64),
            _ => None,
        }
    }

    /// The word in a column of words; none where it is absent.
    pub(super) fn word<'n>(&self, value: ValueOf, words: &'n Words) -> Option<&'n str> {
        let names = &words.names;
        let name = &names[self.field];
        match value {
            ValueOf::OnSkin(OfTouch::Link) => words.link(self.on_skin?.1.link),
            ValueOf::OnSkin(OfTouch::Kind) => Some(self.on_skin?.1.fit?.kind.name()),
            ValueOf::OnSkin(OfTouch::In) if self.on_skin?.1.in_world => Some(&words.skin.as_ref()?.world),
            ValueOf::OnSkin(OfTouch::In) => words.link(self.on_skin?.1.link),
            ValueOf::Recording => words.recordings.get(words.recording).map(String::as_str),
            ValueOf::Field => Some(&name.field),
            ValueOf::Link => Some(self.link(names)),
            ValueOf::Letter => name.letter.as_deref(),
            ValueOf::Signal => name.signal.as_deref(),
            ValueOf::SideLink(side) => words.link(self.contact?.sides[side].link),
            _ => None,
        }
    }

    /// The words in a column of lists, in their order.
    pub(super) fn list<'n>(&self, value: ValueOf, words: &'n Words) -> Vec<Cow<'n, str>> {
        let Some((found, touch)) = self.on_skin else {
            let own = self.percepts.flags(self.frame, self.field);
            return words.flags.iter().filter(|(flag, _)| own.contains(*flag)).map(|(_, name)| name.into()).collect();
        };
        match value {
            ValueOf::OnSkin(OfTouch::Links) => {
                found.links(touch).iter().filter_map(|share| words.link(share.link)).map(Cow::from).collect()
            }
            ValueOf::OnSkin(OfTouch::Fields) => {
                let fields = found.fields(touch).iter();
                fields.map(|share| words.names[share.field as usize].field.as_str().into()).collect()
            }
            ValueOf::OnSkin(OfTouch::Taxels) => {
                let Some(skin) = &words.skin else { return Vec::new() };
                found.taxels(touch).iter().map(|&node| skin.taxels[node as usize].to_string().into()).collect()
            }
            _ => {
                let own = words.touch_flags.iter().filter(|(flag, _)| touch.flags.contains(*flag));
                own.map(|(_, name)| name.into()).collect()
            }
        }
    }

    pub(super) fn is_touched(&self) -> bool {
        self.percepts.in_contact(self.frame, self.field)
    }
}
