// SPDX-License-Identifier: MIT OR Apache-2.0
//! Names of the surfaces, media and luminophores of a scene: one ledger line for each.

/// Names of the lines of a ledger.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Lines {
    /// Parts of surfaces.
    pub surfaces: Vec<String>,
    /// True if light that passes the part goes from a body into the world or back.
    pub(crate) skin: Vec<bool>,
    /// Media.
    pub media: Vec<String>,
    /// Luminescent substances of the media.
    pub luminophores: Vec<String>,
}

impl Lines {
    /// The number of the line of a patch, added if it is new.
    pub(super) fn surface(&mut self, name: &str, skin: bool) -> usize {
        let known = self.surfaces.iter().zip(&self.skin).position(|(n, s)| n == name && *s == skin);
        known.unwrap_or_else(|| {
            self.surfaces.push(name.to_owned());
            self.skin.push(skin);
            self.surfaces.len() - 1
        })
    }

    /// The number of the line of a medium, added if it is new.
    pub(super) fn medium(&mut self, name: &str) -> usize {
        number_of(&mut self.media, name)
    }

    /// The number of the line of a luminophore, added if it is new.
    pub(super) fn luminophore(&mut self, name: &str) -> usize {
        number_of(&mut self.luminophores, name)
    }
}

/// The place of a name in a list, added if it is new.
fn number_of(names: &mut Vec<String>, name: &str) -> usize {
    names.iter().position(|known| known == name).unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    })
}
