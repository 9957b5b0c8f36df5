// SPDX-License-Identifier: MIT OR Apache-2.0
//! Receivers of a checked design.

use serde::Serialize;
use tracer::Detector;

use crate::schema::receivers::Receiver;
use metrics::kinds::ReceiverKind;

/// A receiver of a checked design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckedReceiver {
    /// As written.
    pub stated: Receiver,
    /// As the tracer takes it; its sources are those of the first package, then those of the
    /// second, and so on.
    #[serde(skip)]
    pub detector: Detector,
}

impl CheckedReceiver {
    /// Names its files.
    pub fn name(&self) -> &str {
        &self.stated.shared.name
    }

    /// Target.
    pub fn kind(&self) -> ReceiverKind {
        self.stated.kind.kind()
    }
}
