//! What the first source of a run says of itself: its kind, its body and its calibration.

use std::path::PathBuf;

use super::Setup;
use super::first_source::{Export, Found, Mapped, Text};
use crate::error::Result;
use crate::source::{MappedSource, SourceSpec, TextSource, VendorSource};

impl Setup {
    /// What `look` sees of the lines of text that are listened to, if there are any.
    fn text<T>(&self, look: impl FnOnce(&mut Text) -> T) -> Result<Option<T>> {
        Ok(self.found(|found| Ok(found.text(&self.tell)?.map(look)))?.flatten())
    }

    /// The lines of text that are listened to, for a body whose taxels have `ids`, if there are any and they have not been taken
    /// before.
    pub(crate) fn take_text(&self, ids: &[u32]) -> Result<Option<TextSource>> {
        let source = self.text(|text| text.source.take())?.flatten();
        source.map(|source| source.for_body(ids)).transpose()
    }

    /// The body that is made for lines of text, where none is named.
    pub(crate) fn text_body(&self) -> Result<Option<(String, Vec<u8>)>> {
        let made = self.text(|text| (text.body.clone(), text.about_body.clone()))?;
        let Some((body, about)) = made.filter(|_| self.body.is_none()) else { return Ok(None) };
        self.tell.once(&about);
        Ok(Some(("text".to_owned(), body?)))
    }

    /// What `look` sees of the source whose messages hold arrays, if there is a map.
    fn mapped<T>(&self, look: impl FnOnce(&mut Mapped) -> T) -> Result<Option<T>> {
        Ok(self.found(|found| Ok(found.mapped(&self.tell)?.map(look)))?.flatten())
    }

    /// The source whose messages hold arrays, from its first frame on, if there is one and it has not been taken before.
    pub(crate) fn take_mapped(&self) -> Result<Option<Box<MappedSource>>> {
        Ok(self.mapped(|mapped| mapped.source.take())?.flatten())
    }

    /// The body that is made for arrays within messages, where none is named.
    pub(crate) fn mapped_body(&self) -> Result<Option<(String, Vec<u8>)>> {
        let made = self.mapped(|mapped| (mapped.body.clone(), mapped.about_body.clone()))?;
        let Some((body, about)) = made.filter(|_| self.body.is_none()) else { return Ok(None) };
        let body = body?;
        self.tell.once(&about);
        Ok(Some(("map".to_owned(), body)))
    }

    /// What `look` sees of the first source, which is found out once.
    fn found<T>(&self, look: impl FnOnce(&mut Found) -> Result<T>) -> Result<Option<T>> {
        let Some(source) = self.sources.first() else { return Ok(None) };
        let options = self.export_options()?;
        self.first.look(source, options, look).map(Some)
    }

    /// What `look` sees of the export that is read, if it is one.
    fn export<T>(&self, look: impl FnOnce(&mut Export) -> T) -> Result<Option<T>> {
        Ok(self.found(|found| Ok(found.export()?.map(look)))?.flatten())
    }

    /// The first source, and what its content says that it is.
    pub(crate) fn first_source(&self) -> Result<Option<SourceSpec>> {
        self.found(|found| Ok(found.spec.clone()))
    }

    /// The export that is read, from its first frame on, if it is one and has not been taken before.
    pub(crate) fn take_export(&self) -> Result<Option<Box<VendorSource>>> {
        Ok(self.export(|export| export.source.take())?.flatten())
    }

    /// Whether the export that is read says where its sensors are; `None` where it is none.
    pub(crate) fn export_is_placed(&self) -> Result<Option<bool>> {
        self.export(|export| export.is_placed)
    }

    /// The export whose body is used, which is so where none is named.
    pub(crate) fn export_body(&self) -> Result<Option<(String, Vec<u8>)>> {
        if self.body.is_some() {
            return Ok(None);
        }
        self.export(|export| Ok((export.body_name.clone(), export.body.clone()?)))?.transpose()
    }

    /// The calibration of the export that is read: where it comes from, and its text.
    pub(crate) fn export_calibration(&self) -> Result<Option<(PathBuf, String)>> {
        let known = self.export(|export| Some((export.path.clone(), export.calibration.clone()?)))?.flatten();
        // Of another body than its own it would be refused by name.
        Ok(known.map(|(path, text)| match self.body {
            None => (path, text),
            Some(_) => {
                let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with("body")).collect();
                (path, lines.join("\n"))
            }
        }))
    }
}
