//! An FMI 3.0 importer in one file: it knocks on the door from outside, for `cutis demo` and for the tests.
//!
//! ```text
//! archive --unzip--> folder --dlopen--> fmi3* by name --> set, step, get
//! ```
//!
//! It asks for what the standard gives every importer and knows nothing of this crate's inside, so whatever works here
//! works in a host that was never told about cutis.

use std::ffi::{CString, c_char, c_int, c_void};
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::logger::Status;
use crate::fmu::{FmiVersion, Platform, UnknownPlatform};

/// Why an archive could not be used.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The archive is no zip, or a path in it leads outside.
    #[error("{path} is no usable archive: {why}")]
    Archive {
        /// Which.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// The library cannot be loaded, or lacks a function.
    #[error("{path}: {why}")]
    Library {
        /// Which.
        path: PathBuf,
        /// What the loader says.
        why: String,
    },
    /// The standard has no name for this machine.
    #[error(transparent)]
    Platform(#[from] UnknownPlatform),
    /// There is no such variable.
    #[error("the archive has no {ty} variable named `{name}`")]
    NoVariable {
        /// Name asked for.
        name: String,
        /// Type asked for.
        ty: &'static str,
    },
    /// A function of the standard did not answer OK.
    #[error("{function} returned {status}: {log}")]
    Refused {
        /// Which.
        function: &'static str,
        /// FMI status number.
        status: c_int,
        /// What the component logged meanwhile.
        log: String,
    },
}

/// A variable of the model description.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variable {
    /// Name.
    pub name: String,
    /// Value reference.
    pub reference: u32,
    /// XML element: `Float64`, `Int32`, `Boolean`.
    pub ty: String,
    /// Extent of each dimension; empty for a scalar.
    pub shape: Vec<usize>,
}

impl Variable {
    /// Number of values.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

type Log = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);
#[rustfmt::skip]
type Instantiate2 = unsafe extern "C" fn(*const c_char, c_int, *const c_char, *const c_char, *const [*const c_void; 5], c_int, c_int) -> *mut c_void;
#[rustfmt::skip]
type Instantiate = unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, u8, u8, u8, u8, *const u32, usize, *mut c_void, Option<Log>, *const c_void) -> *mut c_void;
type Free = unsafe extern "C" fn(*mut c_void);
type Plain = unsafe extern "C" fn(*mut c_void) -> c_int;
type Enter = unsafe extern "C" fn(*mut c_void, u8, f64, f64, u8, f64) -> c_int;
type Get<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut T, usize) -> c_int;
type Set<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const T, usize) -> c_int;
type DoStep = unsafe extern "C" fn(*mut c_void, f64, f64, u8, *mut u8, *mut u8, *mut u8, *mut f64) -> c_int;

struct Functions {
    free: Free,
    enter_initialization: Enter,
    exit_initialization: Plain,
    terminate: Plain,
    reset: Plain,
    get_f64: Get<f64>,
    get_i32: Get<i32>,
    set_f64: Set<f64>,
    do_step: DoStep,
}

/// Unpacks an archive of any version, makes an instance of it and frees that.
///
/// # Errors
/// Every [`HostError`] but `NoVariable`.
pub fn instantiate(archive: &Path, version: FmiVersion) -> Result<(), HostError> {
    if version.is_3() {
        return Host::open(archive).map(drop);
    }
    let folder = Folder::new()?;
    unpack(archive, &folder.0)?;
    let (token, _) = read_description(&folder.0.join("modelDescription.xml"))?;
    let library = Library::open(&folder.0.join(Platform::here()?.library(version)))?;
    let (token, resources) = (c_string(&token), c_string(&folder.0.join("resources").display().to_string()));
    // No logger, no memory functions, no environment: what is wrong with a scene the FMI 3.0 archive tells.
    let callbacks = [std::ptr::null(); 5];
    // SAFETY: the types are those of fmi2FunctionTypes.h for these names; strings and callbacks outlive the calls.
    let instance = unsafe {
        let instantiate: Instantiate2 = std::mem::transmute(library.symbol(c"fmi2Instantiate")?);
        let free: Free = std::mem::transmute::<*mut c_void, Free>(library.symbol(c"fmi2FreeInstance")?);
        let (token, resources) = (token.as_ptr(), resources.as_ptr());
        let instance = instantiate(c"cutis".as_ptr(), 1, token, resources, &raw const callbacks, 0, 0);
        free(instance);
        instance
    };
    match instance.is_null() {
        true => Err(refused("fmi2Instantiate", Status::Error as c_int, &[])),
        false => Ok(()),
    }
}

/// One instance of one archive. Dropping it frees the instance and removes the unpacked folder.
pub struct Host {
    instance: *mut c_void,
    functions: Functions,
    variables: Vec<Variable>,
    // Owned, but also behind the component's environment pointer: a Box would claim to be the only way to it.
    log: *mut Vec<String>,
    _folder: Folder,
}

impl Host {
    /// Unpacks `archive`, loads its library and makes an instance.
    ///
    /// # Errors
    /// Every [`HostError`] but `NoVariable`.
    pub fn open(archive: &Path) -> Result<Host, HostError> {
        let folder = Folder::new()?;
        unpack(archive, &folder.0)?;
        let (token, variables) = read_description(&folder.0.join("modelDescription.xml"))?;
        let library = Library::open(&folder.0.join(Platform::here()?.library(FmiVersion::V3)))?;
        // SAFETY: the types are those of fmi3FunctionTypes.h for these names.
        let (instantiate, functions) = unsafe {
            let instantiate: Instantiate = std::mem::transmute(library.symbol(c"fmi3InstantiateCoSimulation")?);
            let functions = Functions {
                free: std::mem::transmute::<*mut c_void, Free>(library.symbol(c"fmi3FreeInstance")?),
                enter_initialization: std::mem::transmute::<*mut c_void, Enter>(
                    library.symbol(c"fmi3EnterInitializationMode")?,
                ),
                exit_initialization: std::mem::transmute::<*mut c_void, Plain>(
                    library.symbol(c"fmi3ExitInitializationMode")?,
                ),
                terminate: std::mem::transmute::<*mut c_void, Plain>(library.symbol(c"fmi3Terminate")?),
                reset: std::mem::transmute::<*mut c_void, Plain>(library.symbol(c"fmi3Reset")?),
                get_f64: std::mem::transmute::<*mut c_void, Get<f64>>(library.symbol(c"fmi3GetFloat64")?),
                get_i32: std::mem::transmute::<*mut c_void, Get<i32>>(library.symbol(c"fmi3GetInt32")?),
                set_f64: std::mem::transmute::<*mut c_void, Set<f64>>(library.symbol(c"fmi3SetFloat64")?),
                do_step: std::mem::transmute::<*mut c_void, DoStep>(library.symbol(c"fmi3DoStep")?),
            };
            (instantiate, functions)
        };
        // The standard wants the separator at the end.
        let resources = c_string(&format!("{}/", folder.0.join("resources").display()));
        let token = c_string(&token);
        let log: *mut Vec<String> = Box::into_raw(Box::default());
        let none = std::ptr::null;
        // SAFETY: strings and log outlive the call; the log outlives the instance, see `Drop`.
        let instance = unsafe {
            instantiate(
                c"cutis".as_ptr(),
                token.as_ptr(),
                resources.as_ptr(),
                0,
                1,
                0,
                0,
                none(),
                0,
                log.cast(),
                Some(keep),
                std::ptr::null(),
            )
        };
        if instance.is_null() {
            // SAFETY: made above; no instance is there to write into it.
            let log = unsafe { Box::from_raw(log) };
            return Err(refused("fmi3InstantiateCoSimulation", Status::Error as c_int, &log));
        }
        Ok(Host { instance, functions, variables, log, _folder: folder })
    }

    /// The variables of the model description, in its order.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// What the component has logged, oldest first.
    pub fn log(&self) -> &[String] {
        // SAFETY: ours, and written only inside calls that borrow the host mutably.
        unsafe { &*self.log }
    }

    fn find(&self, name: &str, ty: &'static str) -> Result<(u32, usize), HostError> {
        let found = self.variables.iter().find(|v| v.name == name && v.ty == ty);
        found.map(|v| (v.reference, v.len())).ok_or_else(|| HostError::NoVariable { name: name.to_owned(), ty })
    }

    fn check(&mut self, function: &'static str, status: c_int) -> Result<(), HostError> {
        if status <= Status::Warning as c_int { Ok(()) } else { Err(refused(function, status, self.log())) }
    }

    /// Enters and leaves Initialization Mode at `start`, s.
    ///
    /// # Errors
    /// [`HostError::Refused`].
    pub fn initialise(&mut self, start: f64) -> Result<(), HostError> {
        // SAFETY: the instance lives until drop.
        let status = unsafe { (self.functions.enter_initialization)(self.instance, 0, 0.0, start, 0, 0.0) };
        self.check("fmi3EnterInitializationMode", status)?;
        // SAFETY: as above.
        let status = unsafe { (self.functions.exit_initialization)(self.instance) };
        self.check("fmi3ExitInitializationMode", status)
    }

    /// Sets all values of a Float64 variable, row-major.
    ///
    /// # Errors
    /// [`HostError::NoVariable`], [`HostError::Refused`].
    pub fn set_f64(&mut self, name: &str, values: &[f64]) -> Result<(), HostError> {
        let (reference, _) = self.find(name, "Float64")?;
        // SAFETY: the instance lives until drop; the component checks the length.
        let status =
            unsafe { (self.functions.set_f64)(self.instance, &raw const reference, 1, values.as_ptr(), values.len()) };
        self.check("fmi3SetFloat64", status)
    }

    /// All values of a Float64 variable, row-major.
    ///
    /// # Errors
    /// [`HostError::NoVariable`], [`HostError::Refused`].
    pub fn get_f64(&mut self, name: &str) -> Result<Vec<f64>, HostError> {
        let mut values = vec![0.0; self.find(name, "Float64")?.1];
        self.get_f64_into(name, &mut values)?;
        Ok(values)
    }

    /// As [`Host::get_f64`], into a buffer of the caller.
    ///
    /// # Errors
    /// [`HostError::NoVariable`], [`HostError::Refused`].
    pub fn get_f64_into(&mut self, name: &str, out: &mut [f64]) -> Result<(), HostError> {
        let (reference, _) = self.find(name, "Float64")?;
        // SAFETY: the instance lives until drop; the component checks the length.
        let status =
            unsafe { (self.functions.get_f64)(self.instance, &raw const reference, 1, out.as_mut_ptr(), out.len()) };
        self.check("fmi3GetFloat64", status)
    }

    /// All values of an Int32 variable, row-major.
    ///
    /// # Errors
    /// [`HostError::NoVariable`], [`HostError::Refused`].
    pub fn get_i32(&mut self, name: &str) -> Result<Vec<i32>, HostError> {
        let (reference, len) = self.find(name, "Int32")?;
        let mut values = vec![0; len];
        // SAFETY: the instance lives until drop; the component checks the length.
        let status =
            unsafe { (self.functions.get_i32)(self.instance, &raw const reference, 1, values.as_mut_ptr(), len) };
        self.check("fmi3GetInt32", status)?;
        Ok(values)
    }

    /// One step from `t` by `dt`, s; returns the time reached.
    ///
    /// # Errors
    /// [`HostError::Refused`], status 2 for a discarded step.
    pub fn step(&mut self, t: f64, dt: f64) -> Result<f64, HostError> {
        let (mut event, mut end, mut early, mut reached) = (0, 0, 0, t);
        // SAFETY: the instance lives until drop; four places for the answers.
        let status = unsafe {
            (self.functions.do_step)(
                self.instance,
                t,
                dt,
                1,
                &raw mut event,
                &raw mut end,
                &raw mut early,
                &raw mut reached,
            )
        };
        self.check("fmi3DoStep", status)?;
        Ok(reached)
    }

    /// Ends the simulation; values can still be read.
    ///
    /// # Errors
    /// [`HostError::Refused`].
    pub fn terminate(&mut self) -> Result<(), HostError> {
        // SAFETY: the instance lives until drop.
        let status = unsafe { (self.functions.terminate)(self.instance) };
        self.check("fmi3Terminate", status)
    }

    /// As after [`Host::open`].
    ///
    /// # Errors
    /// [`HostError::Refused`].
    pub fn reset(&mut self) -> Result<(), HostError> {
        // SAFETY: the instance lives until drop.
        let status = unsafe { (self.functions.reset)(self.instance) };
        self.check("fmi3Reset", status)
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: the instance came from instantiate and nobody else has it; log and library are still there. The
        // library stays loaded: it is this program's own.
        unsafe {
            (self.functions.free)(self.instance);
            drop(Box::from_raw(self.log));
        }
    }
}

fn refused(function: &'static str, status: c_int, log: &[String]) -> HostError {
    HostError::Refused { function, status, log: log.last().cloned().unwrap_or_else(|| "no message".to_owned()) }
}

fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', "")).expect("zero bytes were removed")
}

/// The log callback of every [`Host`].
unsafe extern "C" fn keep(environment: *mut c_void, _status: c_int, _category: *const c_char, message: *const c_char) {
    // SAFETY: the environment is the host's log, which is not borrowed while the component runs; the message is a
    // string for the length of this call.
    unsafe {
        if let (Some(log), Some(message)) = (environment.cast::<Vec<String>>().as_mut(), super::pointer::text(message))
        {
            log.push(message.replace("##", "#"));
        }
    }
}

struct Library {
    handle: *mut c_void,
    path: PathBuf,
}

impl Library {
    fn open(path: &Path) -> Result<Self, HostError> {
        let name = c_string(&path.display().to_string());
        // SAFETY: a string that lives through the call; loading runs no code of ours but Rust's own start-up.
        let handle = unsafe { libc::dlopen(name.as_ptr(), libc::RTLD_NOW | libc::RTLD_LOCAL) };
        if handle.is_null() {
            return Err(HostError::Library { path: path.to_owned(), why: loader_says() });
        }
        Ok(Self { handle, path: path.to_owned() })
    }

    fn symbol(&self, name: &std::ffi::CStr) -> Result<*mut c_void, HostError> {
        // SAFETY: a handle of `dlopen` that is never closed, and a string.
        let symbol = unsafe { libc::dlsym(self.handle, name.as_ptr()) };
        if symbol.is_null() {
            return Err(HostError::Library { path: self.path.clone(), why: loader_says() });
        }
        Ok(symbol)
    }
}

fn loader_says() -> String {
    // SAFETY: `dlerror` returns null or a string that holds until the next call of this thread.
    unsafe { super::pointer::text(libc::dlerror()) }.unwrap_or("unknown reason").to_owned()
}

/// A folder of its own that goes when it is dropped.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self, HostError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("cutis-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).map_err(|source| HostError::File { path: path.clone(), source })?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn unpack(archive: &Path, folder: &Path) -> Result<(), HostError> {
    let file = |path: &Path, source| HostError::File { path: path.to_owned(), source };
    let no_zip = |why: String| HostError::Archive { path: archive.to_owned(), why };
    let opened = fs::File::open(archive).map_err(|source| file(archive, source))?;
    let mut zip = zip::ZipArchive::new(opened).map_err(|why| no_zip(why.to_string()))?;
    for i in 0..zip.len() {
        let mut entry = zip.by_index(i).map_err(|why| no_zip(why.to_string()))?;
        let Some(inside) = entry.enclosed_name() else {
            return Err(no_zip(format!("entry {i} leads outside")));
        };
        if entry.is_dir() {
            continue;
        }
        let path = folder.join(inside);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(|source| file(parent, source))?;
        }
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).map_err(|source| file(&path, source))?;
        fs::write(&path, bytes).map_err(|source| file(&path, source))?;
    }
    Ok(())
}

fn read_description(path: &Path) -> Result<(String, Vec<Variable>), HostError> {
    let text = fs::read_to_string(path).map_err(|source| HostError::File { path: path.to_owned(), source })?;
    let broken = |why: String| HostError::Archive { path: path.to_owned(), why };
    let mut reader = Reader::from_str(&text);
    let (mut token, mut variables) = (String::new(), Vec::<Variable>::new());
    let mut inside = false;
    loop {
        let event = reader.read_event().map_err(|why| broken(why.to_string()))?;
        match event {
            Event::Eof => break,
            Event::End(ref tag) if tag.name().as_ref() == "ModelVariables" => inside = false,
            Event::Start(ref tag) | Event::Empty(ref tag) => {
                let name = tag.name().as_ref().to_owned();
                let read = |key: &str| attribute(tag, key);
                match name.as_str() {
                    "fmiModelDescription" => {
                        token = read("instantiationToken").or_else(|| read("guid")).unwrap_or_default();
                    }
                    "ModelVariables" => inside = true,
                    "Dimension" if inside => {
                        let extent = read("start").and_then(|n| n.parse().ok());
                        let extent = extent.ok_or_else(|| broken("a dimension is not constant".to_owned()))?;
                        let variable =
                            variables.last_mut().ok_or_else(|| broken("a dimension of nothing".to_owned()))?;
                        variable.shape.push(extent);
                    }
                    _ if inside => {
                        let reference = read("valueReference").and_then(|n| n.parse().ok());
                        let (Some(variable), Some(reference)) = (read("name"), reference) else { continue };
                        variables.push(Variable { name: variable, reference, ty: name, shape: Vec::new() });
                    }
                    _ => {}
                }
            }
            _ => {}
        }
    }
    Ok((token, variables))
}

fn attribute(tag: &BytesStart, key: &str) -> Option<String> {
    let found = tag.attributes().flatten().find(|a| a.key.as_ref() == key)?;
    quick_xml::escape::unescape(&found.value).ok().map(|text| text.into_owned())
}
