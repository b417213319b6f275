"""What tests, the benchmark and the tables share: no test is here."""
