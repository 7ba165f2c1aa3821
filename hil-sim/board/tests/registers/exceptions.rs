//! Where the models differ from the description, and why.

/// Values after reset by `PERIPHERAL.REGISTER`, fields by `PERIPHERAL.REGISTER.FIELD`.
pub(super) const EXCEPTIONS: [(&str, &str); 12] = [
    ("TIM1.AF* TIM8.AF*", "by RM0440, TIMx_AFx, BKINE and BK2INE are 1 after reset"),
    ("RCC.CR", "by RM0440, RCC_CR, HSI is on and ready; the description's bits are no fields"),
    ("FLASH.ACR", "by RM0440, FLASH_ACR, DBG_SWEN is 1 after reset"),
    ("GPIO*.IDR", "levels at the pins: pull-ups of the debug port, emergency stop, button"),
    ("DBGMCU.IDCODE", "the chip's identity, category 3, revision X"),
    ("TIM*.SR.*", "flags, cleared by 0; the description has them as written"),
    ("IWDG.KR.KEY TIM*.EGR.UG", "a command: reads as 0"),
    ("EXTI.SWIER1.*", "a command: the model clears it at once, the chip with the flag"),
    ("SPI1.DR8.DR SPI1.DR.DR", "what is written is not what is read"),
    (
        "DMA1.IFCR.* RCC.CSR.RMVF FLASH.SR.* FLASH.ECCR.ECCC* FLASH.ECCR.ECCD*",
        "cleared or reset by 1; reads as 0",
    ),
    ("FLASH.CR.STRT FLASH.CR.OPTLOCK", "set alone; cleared by the end of the operation or a key"),
    ("GPIO*.BSRR.* GPIO*.BRR.*", "a command: reads as 0"),
];
