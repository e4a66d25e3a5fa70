//! From C's pointers to slices and texts and back, with every check that a pointer allows.

use crate::fmi::refusal::Refusal;
use std::ffi::{CStr, c_char};

/// Room for one value that a call gives back.
///
/// # Errors
/// `Refusal::BadPointer` for null and misaligned pointers.
pub(super) fn check<T>(pointer: *const T, argument: &'static str) -> Result<(), Refusal> {
    if pointer.is_null() {
        return Err(Refusal::BadPointer { argument, fault: "is a null pointer" });
    }
    if !pointer.is_aligned() {
        return Err(Refusal::BadPointer { argument, fault: "is not aligned for its type" });
    }
    Ok(())
}

/// An array argument; an empty one may be null.
///
/// # Errors
/// `Refusal::BadPointer` for null and misaligned pointers, and lengths that no array has.
///
/// # Safety
/// A pointer that passes the checks points to `length` values that live and do not change during `'a`.
pub(super) unsafe fn array<'a, T>(
    pointer: *const T,
    length: usize,
    argument: &'static str,
) -> Result<&'a [T], Refusal> {
    if length == 0 {
        return Ok(&[]);
    }
    check(pointer, argument)?;
    if length > isize::MAX as usize / size_of::<T>() {
        return Err(Refusal::BadPointer { argument, fault: "has a length that no array has" });
    }
    // SAFETY: not null, aligned and of possible size as checked; our caller guarantees the rest.
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// A text argument.
///
/// # Errors
/// `Refusal::BadPointer` for null, `Refusal::NotUtf8`.
///
/// # Safety
/// A pointer that is not null points to bytes that end with a zero and live during `'a`.
pub(super) unsafe fn text<'a>(pointer: *const c_char, argument: &'static str) -> Result<&'a str, Refusal> {
    check(pointer, argument)?;
    // SAFETY: not null as checked; our caller guarantees the closing zero.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Refusal::NotUtf8 { argument })
}

/// Writes one result.
///
/// # Errors
/// `Refusal::BadPointer` for null and misaligned pointers.
///
/// # Safety
/// A pointer that passes the checks points to room for a value.
pub(super) unsafe fn write<T>(pointer: *mut T, value: T, argument: &'static str) -> Result<(), Refusal> {
    check(pointer, argument)?;
    // SAFETY: not null and aligned as checked; our caller guarantees the room.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Writes results into an array of the caller; nothing is read from it, so it need not be initialized.
///
/// # Errors
/// `Refusal::BadPointer` for null and misaligned pointers, unless there is nothing to write.
///
/// # Safety
/// A pointer that passes the checks points to room for `values.len()` values, apart from `values`.
pub(super) unsafe fn write_all<T: Copy>(
    pointer: *mut T,
    values: &[T],
    argument: &'static str,
) -> Result<(), Refusal> {
    if values.is_empty() {
        return Ok(());
    }
    check(pointer, argument)?;
    // SAFETY: not null and aligned as checked; our caller guarantees room and separateness.
    unsafe { pointer.copy_from_nonoverlapping(values.as_ptr(), values.len()) };
    Ok(())
}
