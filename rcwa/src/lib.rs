//! rcwa
