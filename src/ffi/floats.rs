//! The host's floating-point environment, put away while a call is under way.
//!
//! Hosts trap exceptions, round otherwise, or flush small numbers to zero; the bits of a step follow from none of it, and what a
//! solver tries on its way (a division by zero that is caught a line later) is no reason to die. So every call computes in the
//! default environment and gives the host its own back, sticky flags included; so do the host's callbacks in between.

#[cfg(target_arch = "x86_64")]
mod machine {
    use std::arch::asm;

    /// Control and status of both units: 28 bytes of the x87, and the register of SSE.
    #[derive(Clone, Copy)]
    #[repr(C)]
    pub(super) struct Environment {
        x87: [u32; 7],
        mxcsr: u32,
    }

    /// All exceptions masked, rounding to nearest, nothing flushed.
    static MXCSR: u32 = 0x1f80;

    pub(super) fn put_away() -> Environment {
        let mut saved = Environment { x87: [0; 7], mxcsr: 0 };
        // SAFETY: both places are writable; what is changed is the environment alone, which Rust wants as it is left here.
        unsafe {
            asm!(
                "fnstenv [{x87}]", "fninit", "stmxcsr [{mxcsr}]", "ldmxcsr [{default}]",
                x87 = in(reg) saved.x87.as_mut_ptr(), mxcsr = in(reg) &raw mut saved.mxcsr, default = in(reg) &raw const MXCSR,
                options(nostack),
            );
        }
        saved
    }

    pub(super) fn give_back(saved: &Environment) {
        // SAFETY: the numbers were read off the same registers by `put_away`; nothing is computed before the host goes on.
        unsafe {
            asm!(
                "fldenv [{x87}]", "ldmxcsr [{mxcsr}]",
                x87 = in(reg) saved.x87.as_ptr(), mxcsr = in(reg) &raw const saved.mxcsr,
                options(nostack),
            );
        }
    }
}

#[cfg(target_arch = "aarch64")]
mod machine {
    use std::arch::asm;

    /// Control and status.
    #[derive(Clone, Copy)]
    pub(super) struct Environment {
        fpcr: u64,
        fpsr: u64,
    }

    pub(super) fn put_away() -> Environment {
        let mut saved = Environment { fpcr: 0, fpsr: 0 };
        // SAFETY: what is changed is the environment alone, which Rust wants as it is left here.
        unsafe {
            asm!(
                "mrs {c}, fpcr", "mrs {s}, fpsr", "msr fpcr, xzr", "msr fpsr, xzr",
                c = out(reg) saved.fpcr, s = out(reg) saved.fpsr, options(nomem, nostack),
            );
        }
        saved
    }

    pub(super) fn give_back(saved: &Environment) {
        // SAFETY: the numbers were read off the same registers by `put_away`; nothing is computed before the host goes on.
        unsafe {
            asm!("msr fpcr, {c}", "msr fpsr, {s}", c = in(reg) saved.fpcr, s = in(reg) saved.fpsr, options(nomem, nostack));
        }
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod machine {
    #[derive(Clone, Copy)]
    pub(super) struct Environment;

    pub(super) fn put_away() -> Environment {
        Environment
    }

    pub(super) fn give_back(_: &Environment) {}
}

/// Our environment, until it is dropped; calls may stand within calls.
pub(super) struct Ours {
    host: machine::Environment,
}

impl Ours {
    /// Puts that of the host away.
    pub(super) fn begin() -> Ours {
        Ours { host: machine::put_away() }
    }
}

impl Drop for Ours {
    fn drop(&mut self) {
        machine::give_back(&self.host);
    }
}
