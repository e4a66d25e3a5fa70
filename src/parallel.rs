//! Threads of one instance.

/// Runs `work` in a pool of threads that have ended when this returns.
///
/// # Errors
/// Where no thread can be started.
///
/// rayon's own `build_scoped` only waits until its threads have no more work; on their way out they still run code of this
/// library, which the importer may unload.
pub fn in_pool<T: Send>(
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<T, rayon::ThreadPoolBuildError> {
    std::thread::scope(|scope| {
        let mut handles = Vec::new();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).spawn_handler(|thread| {
            handles.push(std::thread::Builder::new().spawn_scoped(scope, || thread.run())?);
            Ok(())
        });
        let result = pool.build().map(|pool| pool.install(work));
        // A thread's own panic has been passed on by `install`.
        handles.into_iter().for_each(|handle| drop(handle.join()));
        result
    })
}
