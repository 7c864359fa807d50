//! The system calls that a sandboxed program may use: a filter of system calls, as bubblewrap takes it.

#[cfg(all(
    target_os = "linux",
    target_endian = "little",
    any(target_arch = "x86_64", target_arch = "aarch64")
))]
pub(super) fn filter() -> Option<Vec<u8>> {
    Some(linux::filter())
}

/// Elsewhere the numbers of system calls are not known, and only namespaces protect.
#[cfg(not(all(
    target_os = "linux",
    target_endian = "little",
    any(target_arch = "x86_64", target_arch = "aarch64")
)))]
pub(super) fn filter() -> Option<Vec<u8>> {
    None
}

#[cfg(all(
    target_os = "linux",
    target_endian = "little",
    any(target_arch = "x86_64", target_arch = "aarch64")
))]
mod linux {
    use nix::libc;

    /// The architecture by its name in the kernel's audit.
    #[cfg(target_arch = "x86_64")]
    const ARCHITECTURE: u32 = 0xc000_003e;
    #[cfg(target_arch = "aarch64")]
    const ARCHITECTURE: u32 = 0xc000_00b7;

    /// Calls that no namespace encloses, or that open the kernel wide: keys of the user's session, memory that no limit sees,
    /// further namespaces and mounts, modules, clocks, tracing of the kernel.
    const REFUSED: [libc::c_long; 41] = [
        libc::SYS_add_key,
        libc::SYS_keyctl,
        libc::SYS_request_key,
        libc::SYS_shmget,
        libc::SYS_msgget,
        libc::SYS_unshare,
        libc::SYS_setns,
        libc::SYS_mount,
        libc::SYS_umount2,
        libc::SYS_pivot_root,
        libc::SYS_chroot,
        libc::SYS_move_mount,
        libc::SYS_open_tree,
        libc::SYS_fsopen,
        libc::SYS_fsconfig,
        libc::SYS_fsmount,
        libc::SYS_fspick,
        libc::SYS_mount_setattr,
        libc::SYS_name_to_handle_at,
        libc::SYS_open_by_handle_at,
        libc::SYS_bpf,
        libc::SYS_perf_event_open,
        libc::SYS_userfaultfd,
        libc::SYS_io_uring_setup,
        libc::SYS_io_uring_enter,
        libc::SYS_io_uring_register,
        libc::SYS_fanotify_init,
        libc::SYS_kexec_load,
        libc::SYS_init_module,
        libc::SYS_finit_module,
        libc::SYS_delete_module,
        libc::SYS_quotactl,
        libc::SYS_swapon,
        libc::SYS_swapoff,
        libc::SYS_reboot,
        libc::SYS_syslog,
        libc::SYS_acct,
        libc::SYS_settimeofday,
        libc::SYS_clock_settime,
        libc::SYS_clock_adjtime,
        libc::SYS_vhangup,
    ];

    /// Families of sockets: those of the machine itself (vsock, packets, Bluetooth) have no namespace of a network.
    const FAMILIES: [libc::c_int; 4] = [
        libc::AF_UNIX,
        libc::AF_INET,
        libc::AF_INET6,
        libc::AF_NETLINK,
    ];

    /// Requests that type into a terminal.
    const TYPING: [u32; 2] = [libc::TIOCSTI as u32, libc::TIOCLINUX as u32];

    // Instructions of the filter, and what it returns.
    const LOAD: u16 = 0x20;
    const EQUAL: u16 = 0x15;
    #[cfg(target_arch = "x86_64")]
    const AT_LEAST: u16 = 0x35;
    const RETURN: u16 = 0x06;
    const ALLOW: u32 = 0x7fff_0000;
    const KILL: u32 = 0x8000_0000;
    const FAIL: u32 = 0x0005_0000;

    /// The positions of a call's number, architecture and first two arguments.
    const NUMBER: u32 = 0;
    const OF_ARCHITECTURE: u32 = 4;
    const FIRST: u32 = 16;
    const SECOND: u32 = 24;

    struct Filter(Vec<u8>);

    impl Filter {
        /// One instruction, with how many to skip if its condition holds and if not.
        fn push(&mut self, code: u16, [holds, fails]: [u8; 2], value: u32) {
            self.0.extend(code.to_le_bytes());
            self.0.extend([holds, fails]);
            self.0.extend(value.to_le_bytes());
        }

        fn load(&mut self, what: u32) {
            self.push(LOAD, [0, 0], what);
        }

        fn give(&mut self, what: u32) {
            self.push(RETURN, [0, 0], what);
        }

        fn when(&mut self, value: u32, what: u32) {
            self.push(EQUAL, [0, 1], value);
            self.give(what);
        }
    }

    pub fn filter() -> Vec<u8> {
        let fail = |error: libc::c_int| FAIL | error as u32;
        let mut of = Filter(Vec::new());
        of.load(OF_ARCHITECTURE);
        of.push(EQUAL, [1, 0], ARCHITECTURE);
        of.give(KILL);
        of.load(NUMBER);
        #[cfg(target_arch = "x86_64")]
        {
            // The same calls under other numbers (x32).
            of.push(AT_LEAST, [0, 1], 0x4000_0000);
            of.give(fail(libc::ENOSYS));
        }
        // Calls that a kernel may lack are reported as missing, so that programs do without.
        of.when(libc::SYS_memfd_create as u32, fail(libc::ENOSYS));
        for call in REFUSED {
            of.when(call as u32, fail(libc::EPERM));
        }
        let families = FAMILIES.len() as u8;
        of.push(EQUAL, [0, 2 * families + 2], libc::SYS_socket as u32);
        of.load(FIRST);
        for family in FAMILIES {
            of.when(family as u32, ALLOW);
        }
        of.give(fail(libc::EAFNOSUPPORT));
        let requests = TYPING.len() as u8;
        of.push(EQUAL, [0, 2 * requests + 1], libc::SYS_ioctl as u32);
        of.load(SECOND);
        for request in TYPING {
            of.when(request, fail(libc::EPERM));
        }
        of.give(ALLOW);
        of.0
    }
}
