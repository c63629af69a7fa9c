//! Pictures in files and on contact sheets.
