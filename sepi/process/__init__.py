"""What a process of this package needs of its system: commands, threads, memory, interrupts, kept arrays."""
