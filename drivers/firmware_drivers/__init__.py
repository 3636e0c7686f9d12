"""Hardware atomic models, which know DEVS and no register; `chips` knows registers and no DEVS."""
