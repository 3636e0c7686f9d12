"""The Debian package: `make deb`. Its maintainer scripts are the `.sh` files beside this one."""
