"""Chip drivers, one chip a file: registers on one side, SI units on the other; no DEVS, no wait.

`i2c_chip` is the base of those on I2C, `register_chip` that of written ones. `step`, `mounting`,
`bearing`, `liveness`, `shared_bring_up`, `mpu9250_*` and `pca9685_registers` are parts of drivers;
`h_bridge` is three outputs of a PCA9685.
"""
