//! Pointers of a host become slices and strings, or a reason why not.

use std::ffi::{CStr, c_char};

use super::instance::{Refusal, error};

fn refused<T>(data: *const T, n: usize, what: &str) -> Result<(), Refusal> {
    if data.is_null() {
        return Err(error(format!("{what} is NULL")));
    }
    if !data.is_aligned() {
        return Err(error(format!("{what} is not aligned for its type")));
    }
    if n > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(error(format!("{what} cannot have {n} elements")));
    }
    Ok(())
}

/// `n` elements at `data`; with `n == 0` the pointer may be anything.
///
/// # Safety
/// `data` is null or points to `n` elements that nobody writes while the slice is used.
pub(super) unsafe fn slice<'a, T>(data: *const T, n: usize, what: &str) -> Result<&'a [T], Refusal> {
    if n == 0 {
        return Ok(&[]);
    }
    refused(data, n, what)?;
    // SAFETY: not null, aligned, not longer than an object can be; the rest is the caller's promise.
    Ok(unsafe { std::slice::from_raw_parts(data, n) })
}

/// `n` writable elements at `data`; with `n == 0` the pointer may be anything.
///
/// # Safety
/// `data` is null or points to `n` elements that nobody else uses while the slice is used.
pub(super) unsafe fn slice_mut<'a, T>(data: *mut T, n: usize, what: &str) -> Result<&'a mut [T], Refusal> {
    if n == 0 {
        return Ok(&mut []);
    }
    refused(data, n, what)?;
    // SAFETY: as in `slice`.
    Ok(unsafe { std::slice::from_raw_parts_mut(data, n) })
}

/// One writable value.
///
/// # Safety
/// `data` is null or points to a `T` that nobody else uses while the reference is used.
pub(super) unsafe fn place<'a, T>(data: *mut T, what: &str) -> Result<&'a mut T, Refusal> {
    // SAFETY: the caller's promise.
    let one = unsafe { slice_mut(data, 1, what)? };
    Ok(&mut one[0])
}

/// A zero-terminated UTF-8 string; `None` for null or other encodings.
///
/// # Safety
/// `text` is null or points to a zero-terminated string that outlives the reference.
pub(super) unsafe fn text<'a>(text: *const c_char) -> Option<&'a str> {
    if text.is_null() {
        return None;
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(text) }.to_str().ok()
}
