//! One run at a time in a results directory.
//!
//! Within the process a list of directories tells; between processes a lock of the operating system on the
//! file `.swarf.lock`, which ends with the process however it ends. The file names the process and is removed
//! with the lock; one that a killed process has left means nothing. Where a file system knows no locks, the
//! list alone guards.

use crate::Error;
use crate::output::vtk::MARK;
use std::collections::HashSet;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

/// Name of the lock's file.
pub const LOCK_FILE: &str = ".swarf.lock";

/// Directories that runs of this process write into.
static IN_USE: LazyLock<Mutex<HashSet<PathBuf>>> = LazyLock::new(Mutex::default);

fn in_use() -> MutexGuard<'static, HashSet<PathBuf>> {
    // A set of paths is whole whatever panicked.
    IN_USE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The right to write into a directory, until it is dropped.
#[derive(Debug)]
pub struct DirectoryLock {
    directory: PathBuf,
    file: Option<File>,
}

impl DirectoryLock {
    /// Takes a directory, which must exist.
    ///
    /// # Errors
    /// `Error::File` when another run holds it, or a foreign file has the lock's name.
    pub fn take(directory: &Path) -> Result<Self, Error> {
        let path = directory.display().to_string();
        let refused = |reason: String| Error::File { path: path.clone(), reason };
        let directory = fs::canonicalize(directory).map_err(|e| refused(e.to_string()))?;
        if !in_use().insert(directory.clone()) {
            return Err(refused(taken("this process")));
        }
        // From here on dropping it takes the directory off the list.
        let mut lock = DirectoryLock { directory, file: None };
        lock.file = lock_file(&lock.directory.join(LOCK_FILE)).map_err(refused)?;
        Ok(lock)
    }
}

impl Drop for DirectoryLock {
    fn drop(&mut self) {
        if let Some(file) = self.file.take() {
            // While the lock is held, so that whoever waits for this file finds that it is gone, and makes
            // another. One that cannot be removed means nothing.
            let _ = fs::remove_file(self.directory.join(LOCK_FILE));
            drop(file);
        }
        in_use().remove(&self.directory);
    }
}

fn taken(by: &str) -> String {
    format!(
        "results.directory is in use by another run in {by}, and two would overwrite each other's files: \
         give each run a directory of its own"
    )
}

/// Locks the file, made if there is none; nothing where files cannot be locked.
fn lock_file(path: &Path) -> Result<Option<File>, String> {
    for _ in 0..100 {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(|e| format!("{LOCK_FILE}: {e}"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(taken(&holder(path))),
            Err(TryLockError::Error(_)) => return Ok(None),
        }
        let mut text = String::new();
        let is_ours = file.read_to_string(&mut text).is_ok() && (text.is_empty() || text.contains(MARK));
        if !is_ours {
            return Err(format!("{LOCK_FILE} there was not written by swarf; it is left as it is"));
        }
        let own = format!("# {MARK}: process {}\n", std::process::id());
        let written = file.set_len(0).and_then(|()| {
            file.rewind()?;
            file.write_all(own.as_bytes())?;
            file.flush()
        });
        written.map_err(|e| format!("{LOCK_FILE}: {e}"))?;
        // Its former holder may have removed it between our opening and locking it; Windows keeps a locked
        // file from readers.
        if cfg!(windows) || fs::read_to_string(path).is_ok_and(|found| found == own) {
            return Ok(Some(file));
        }
    }
    Err(taken("another process"))
}

/// Who holds the lock, as its file says.
fn holder(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap_or_default();
    text.rsplit_once(": ").map_or("another process".into(), |(_, process)| process.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("swarf-lock-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        path
    }

    /// By whatever path a directory is named, it is taken once, and free again afterwards with nothing left
    /// in it.
    #[test]
    fn a_directory_is_taken_once_at_a_time() {
        let folder = folder("once");
        let first = DirectoryLock::take(&folder).unwrap();
        let other_name = folder.join("..").join(folder.file_name().unwrap());
        let text = DirectoryLock::take(&other_name).unwrap_err().to_string();
        assert!(text.contains("in use by another run in this process"), "{text}");
        assert!(folder.join(LOCK_FILE).exists());
        drop(first);
        assert!(!folder.join(LOCK_FILE).exists());
        drop(DirectoryLock::take(&other_name).unwrap());
        fs::remove_dir(&folder).unwrap();
    }

    /// A lock held on the file by someone who is not on the list is another process's: the system does not
    /// tell them apart.
    #[test]
    fn a_directory_that_another_process_holds_is_refused_and_a_killed_ones_is_not() {
        let folder = folder("process");
        let path = folder.join(LOCK_FILE);
        fs::write(&path, format!("# {MARK}: process 4711\n")).unwrap();
        let other = File::open(&path).unwrap();
        other.lock().unwrap();
        let text = DirectoryLock::take(&folder).unwrap_err().to_string();
        assert!(cfg!(windows) || text.contains("in use by another run in process 4711"), "{text}");
        // Its process ends without removing the file.
        drop(other);
        drop(DirectoryLock::take(&folder).unwrap());
        fs::write(&path, "mine").unwrap();
        let text = DirectoryLock::take(&folder).unwrap_err().to_string();
        assert!(text.contains("not written by swarf"), "{text}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
        fs::remove_dir_all(&folder).unwrap();
    }
}
